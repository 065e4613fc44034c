"""Both strategies, for every kind of problem."""

from collections.abc import Callable
from functools import partial

import pytest

from robocal.identification.identify import identify
from robocal.identification.result import Identification
from robocal.identification.strategies import STRATEGIES


@pytest.fixture(params=STRATEGIES)
def identified(request: pytest.FixtureRequest) -> Callable[..., Identification]:
    """What `identify` gives by each strategy."""
    return partial(identify, strategy=request.param)

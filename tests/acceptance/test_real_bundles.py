"""The measured robots of public data sets: what the identification leaves on poses held out.

Limits in mm, from the project's first goals: nominal geometry with fitted frames leaves `before`,
the identified geometry at most `after`.
"""

from functools import cache
from pathlib import Path

import pytest

from robocal.formats.bundle import read_bundle
from robocal.identification.identify import identify
from robocal.identification.result import Identification

DATA = Path(__file__).parents[2].parent / "shared" / "data"
pytestmark = pytest.mark.skipif(
    not DATA.is_dir(), reason="the measured bundles (shared/data beside the checkout) are absent"
)
REAL = {"ur5": (0.56, 0.106), "ipa_ur10_b": (1.09, 0.43), "ipa_ur10_a": (0.85, 0.45)}


@cache
def identified(name: str) -> Identification:
    """A bundle, identified once, without any guess."""
    return identify(read_bundle(DATA / name))


@pytest.mark.parametrize("name", REAL)
def test_the_error_on_held_out_poses_is_as_small_as_promised(name):
    before, after = REAL[name]
    result = identified(name)
    assert result.converged
    assert result.before.position_rms * 1e3 == pytest.approx(before, rel=0.02)
    assert result.held_out.position_rms * 1e3 <= after


@pytest.mark.parametrize("name", REAL)
def test_the_held_out_poses_are_those_of_the_split_column(name):
    header, *rows = (DATA / name / "measurements.csv").read_text().splitlines()
    assert header.endswith(",split")
    check = sum(row.endswith(",check") for row in rows)
    result = identified(name)
    assert result.held_out.rows == result.before.rows == check
    assert result.fit.rows + len(result.rejected) == len(rows) - check


@pytest.mark.parametrize(
    ("name", "least", "most"), [("ipa_ur10_b", 30, 30), ("ipa_ur10_a", 30, 30), ("ur5", 25, 27)]
)
def test_the_data_determine_so_many_parameters(name, least, most):
    """30 by full poses, 27 by positions; the UR5's target is so near axis 6 that fewer show."""
    assert least <= identified(name).rank <= most

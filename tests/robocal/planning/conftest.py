import numpy as np
import pytest

from robocal.planning.candidates import draw_candidates
from robocal.planning.cell import Cell
from robocal.planning.pose_rows import pose_rows
from robocal.robots.library import load_robot


@pytest.fixture(scope="session")
def tx60():
    return load_robot("staubli_tx60")


@pytest.fixture(scope="session")
def candidates(tx60):
    return draw_candidates(tx60, 80, np.random.default_rng(3))


@pytest.fixture(scope="session")
def rows(tx60, candidates):
    return pose_rows(tx60, Cell(), candidates)


@pytest.fixture(scope="session")
def test_rows(tx60, rows):
    return rows.position_rows(draw_candidates(tx60, 40, np.random.default_rng(4)))

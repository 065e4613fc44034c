"""Hidden stage faults are found and named."""

import numpy as np
import pytest

from robocal.base_calibration.faults import SLIPPED, examine
from robocal.base_calibration.stage import Stage
from tests.robocal.base_calibration.stage_cell import (
    LEVEL_CELL,
    TILTED_CELL,
    Faults,
    Plan,
    simulate,
    wide_plan,
    within_prior,
)

STAGE = Stage(0.05e-3, 0.02e-3, 0.1e-3, level_in_master=False, level_in_slave=False)
RUNS = 20
FAULTS = {"squareness": 1e-3, "angle_zero": 2e-3, "rod_zero": 0.2e-3}


def found_in(run: int, fault: str) -> tuple[list[tuple[str, tuple[int, ...]]], int]:
    rng = np.random.default_rng((11, run))
    faults = Faults(**within_prior(STAGE.prior_std, rng))
    slipped = int(rng.integers(30))
    if fault == SLIPPED:
        direction = rng.normal(size=3)
        faults.slips[slipped] = tuple(0.8e-3 * direction / np.linalg.norm(direction))
    else:
        setattr(faults, fault, getattr(faults, fault) + FAULTS[fault])
    touches = simulate(TILTED_CELL, wide_plan(), faults, rng)
    return [(entry.fault, entry.lines) for entry in examine(touches, STAGE).faults], slipped + 1


@pytest.mark.parametrize("fault", list(FAULTS))
def test_a_stage_fault_is_named_first(fault):
    right = sum(found_in(run, fault)[0][:1] == [(fault, ())] for run in range(RUNS))
    assert right >= RUNS - 1


def test_the_slipped_touch_is_named_by_its_line():
    right = 0
    for run in range(RUNS):
        found, line = found_in(run, SLIPPED)
        right += found[:1] == [(SLIPPED, (line,))]
    assert right >= RUNS - 1


def test_the_transform_recovers_once_the_slipped_touch_is_out():
    faults = Faults(slips={7: (3e-3, -2e-3, 1e-3)})
    touches = simulate(TILTED_CELL, wide_plan(), faults, np.random.default_rng(2))
    done = examine(touches, STAGE)
    assert done.rejected == (8,)
    away = done.solution.state.slave[:3, 3] - TILTED_CELL.slave[:3, 3]
    assert np.linalg.norm(away) < 0.5e-3


def test_a_touch_in_the_wrong_cup_is_taken_out():
    plan = wide_plan()
    touches = simulate(TILTED_CELL, plan, Faults(), np.random.default_rng(2))
    on_rod = plan.on_rod.copy()
    on_rod[12] = False
    wrong = type(touches)(**{**touches.__dict__, "on_rod": on_rod})
    assert examine(wrong, STAGE).rejected == (13,)


def test_slips_that_cannot_be_told_apart_are_all_mentioned_and_none_is_taken_out():
    """With two touches each only the distances P1P2 and R1R2 can disagree."""
    plan = Plan.of([
        (0, 1, 0.0, 0.0, 0.5), (0, 0, 0.0, 0, 0), (1, 1, 1.5, 0.6, 0.6), (1, 1, 1.5, -0.4, 0.8),
    ])  # fmt: skip
    faults = Faults(slips={2: (0.0, 0.0, 0.0)})
    touches = simulate(LEVEL_CELL, plan, faults, np.random.default_rng(3))
    line = touches.tips[3] - touches.tips[2]
    touches.needle_poses[2, :3, 3] -= 3e-3 * line / np.linalg.norm(line)
    done = examine(touches, STAGE)
    assert [(fault.fault, fault.lines) for fault in done.faults] == [(SLIPPED, (3, 4))]
    assert not done.rejected
    assert not done.faults[0].remedied

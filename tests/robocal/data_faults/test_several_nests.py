"""Several nests on the tool: their slips are named alike, and no misfit goes on to a fit."""

import numpy as np
import pytest

from robocal.data_faults.rows import find_row_slips
from robocal.data_faults.search import find_slips
from robocal.data_faults.slip import Fault, mend
from robocal.errors import NoAnswer
from robocal.formats.bundle import read_bundle
from tests.robocal.data_faults import spoiled
from tests.robocal.data_faults.slip_study import (
    alarm_on_sound_data,
    gives_back,
    several_nests,
    sound_nests,
    spoil_and_find,
)
from tests.robocal.data_faults.spoiled import Campaign


def measured(poses: int, nests: int, robot: str = "ur10e") -> spoiled.Table:
    return Campaign(robot, seed=3, rows=poses * nests, full_pose=False, nests=nests).measure()


def find(folder, table: spoiled.Table):
    table.write(folder, "ur10e")
    return find_slips(read_bundle(folder))


def test_seeded_slips_with_several_nests_are_named(tmp_path):
    """The study itself, reduced: 30 slips."""
    trials = [spoil_and_find(tmp_path / str(seed), seed, drawn=several_nests) for seed in range(30)]
    missed = [trial for trial in trials if not trial.right]
    assert not missed


def test_sound_data_of_several_nests_are_not_blamed(tmp_path):
    """3 to 40 poses, some with outliers or sagging joints, some in small volumes."""
    said = [
        alarm_on_sound_data(tmp_path / str(seed), seed, drawn=sound_nests) for seed in range(30)
    ]
    assert not any(said), [text for text in said if text]


@pytest.mark.parametrize("nests", [3, 4, 12])
@pytest.mark.parametrize("by", [1, 3, -2, -5])
def test_a_shift_within_and_across_poses_is_told_to_the_row(tmp_path, nests, by):
    """Any one nest fits under several shifts: all its rows of a pose share their joints."""
    table = measured(40, nests)
    table.write(tmp_path / "sound", "ur10e")
    source = np.clip(np.arange(len(table)) - by, 0, len(table) - 1)
    rows = np.arange(max(by, 0), len(table) + min(by, 0))
    shifted = spoiled.keep_rows(table.measured_at(source), rows)
    (slip,) = find(tmp_path / "spoiled", shifted)
    count = f"{abs(by)} row{'s' * (abs(by) > 1)}"
    where = f"{count} {'earlier' if by > 0 else 'later'}"
    assert slip.sentence.startswith(f"in every line the measurements belong to the joints {where}:")
    mended = mend(read_bundle(tmp_path / "spoiled"), (slip,))
    assert len(mended.measurements) == len(rows) - abs(by)
    assert gives_back(mended, read_bundle(tmp_path / "sound"), exact=True)


@pytest.mark.parametrize(
    ("kind", "fault"),
    [(spoiled.positions_in_another_unit, Fault.unit), (spoiled.joint_sign, Fault.joint_sign)],
)
def test_fourteen_poses_of_four_nests_are_enough_for_a_name(tmp_path, kind, fault):
    spoilt = kind(measured(14, 4), np.random.default_rng(2))
    (slip,) = find(tmp_path, spoilt.table)
    assert (slip.fault, slip.columns) == (fault, spoilt.columns)


@pytest.mark.parametrize(("poses", "nests"), [(6, 1), (12, 1), (8, 2), (5, 4)])
def test_few_poses_that_miss_by_far_are_stopped_without_a_name(tmp_path, poses, nests):
    spoilt = spoiled.radians(measured(poses, nests), np.random.default_rng(1))
    with pytest.raises(NoAnswer, match=r"missed by [0-9]+ mm, and too few poses"):
        find(tmp_path, spoilt.table)


def test_one_wrong_nest_of_twenty_is_stopped(tmp_path):
    """Five rows of a hundred: too few to count, were it not for the nest that is wrong always."""
    table = measured(6, 20)
    source = np.arange(len(table)) + 1
    source[-1] = 0
    with pytest.raises(NoAnswer, match="too few poses"):
        find(tmp_path, table.measured_at(source))


def test_a_shift_that_mends_only_half_of_the_rows_is_not_named(tmp_path):
    table = measured(40, 3)
    source = np.arange(len(table))
    source[:60] += 1
    source[60:] = 60 + np.random.default_rng(1).permutation(60)
    with pytest.raises(NoAnswer, match="no slip of unit"):
        find(tmp_path, table.measured_at(source))


def test_of_shifts_that_fit_alike_the_smallest_is_named():
    rows = np.arange(20)
    (slip,) = find_row_slips(
        order=rows,
        lines=rows + 2,
        seen=np.ones(20, dtype=bool),
        distance=lambda measured, joints: np.where(np.abs(measured - joints - 3) <= 1, 0.0, 9.0),
        tolerance=1.0,
    )
    assert "in every line the measurements belong to the joints 2 rows earlier" in slip.sentence


def test_one_pose_measured_again_and_again_shows_nothing(tmp_path):
    table = measured(30, 1)
    assert find(tmp_path, spoiled.keep_rows(table, np.zeros(30, dtype=int))) == ()


def test_rows_before_an_early_shift_keep_their_joints(tmp_path):
    """Only one row of three shows it: those before it must count more than where a file begins."""
    table = measured(12, 3)
    table.write(tmp_path / "sound", "ur10e")
    source = np.arange(len(table))
    source[8:] -= 1
    (slip,) = find(tmp_path / "spoiled", table.measured_at(source))
    assert min(slip.lines) > 9
    mended = mend(read_bundle(tmp_path / "spoiled"), (slip,))
    assert len(mended.measurements) == len(table)
    assert gives_back(mended, read_bundle(tmp_path / "sound"), exact=True)

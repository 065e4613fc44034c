"""Lengths alone get no name, but they are not fitted where the robot cannot give them."""

from dataclasses import replace

import numpy as np
import pytest

from robocal.data_faults.search import find_slips
from robocal.errors import NoAnswer
from robocal.formats.bundle import Bundle, read_bundle
from tests.robocal.data_faults.spoiled import NAMES, Campaign


def lengths_of(folder, robot: str, rows: int = 60) -> Bundle:
    """A sound bundle of lengths from a point beside the robot, a few of them wrong."""
    Campaign(robot, seed=5, rows=rows, full_pose=False, outliers=0.04).measure().write(
        folder, robot
    )
    bundle = read_bundle(folder)
    position = bundle.measurements.position
    anchor = position.mean(axis=0) + np.array([0.7, 0.5, 0.3])
    measured = replace(
        bundle.measurements,
        position=np.full_like(position, np.nan),
        distance=np.linalg.norm(position - anchor, axis=1),
    )
    return replace(bundle, measurements=measured)


@pytest.mark.parametrize("robot", NAMES)
def test_sound_lengths_pass(tmp_path, robot):
    assert find_slips(lengths_of(tmp_path, robot)) == ()


@pytest.mark.parametrize("factor", [1e-3, 1 / 25.4])
def test_lengths_in_another_unit_are_refused(tmp_path, factor):
    bundle = lengths_of(tmp_path, "ur10e")
    rows = replace(bundle.measurements, distance=bundle.measurements.distance * factor)
    with pytest.raises(NoAnswer, match="the lengths do not fit robot 'ur10e'"):
        find_slips(replace(bundle, measurements=rows))


def test_lengths_beside_the_joints_of_another_row_are_refused(tmp_path):
    bundle = lengths_of(tmp_path, "ur10e")
    rows = replace(bundle.measurements, distance=np.roll(bundle.measurements.distance, 1))
    with pytest.raises(NoAnswer, match="the lengths do not fit robot 'ur10e'"):
        find_slips(replace(bundle, measurements=rows))

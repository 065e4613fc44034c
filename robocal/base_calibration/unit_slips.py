"""Readings in another unit than their column says: named before any fault is looked for.

A column in metres or radians does not look like a faulty stage but like many slipped touches at
once. Each slip is undone in turn; one is named where the registration then fits, and before did
not.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.base_calibration.arm import Arm
from robocal.base_calibration.next_touch import Pair
from robocal.base_calibration.solution import Solution, solve
from robocal.base_calibration.stage import Stage
from robocal.base_calibration.touches import Touches
from robocal.errors import NoAnswer

_HOPELESS = 1e4
"""Chi-square per degree of freedom from which a unit, and not a fault, is suspected; [1]"""
_SHARE = 1e-3
"""A slip is named when undoing it leaves less than this share of the chi-square; [1]"""
_FITS = 10.0
"""Below it no further slip is tried; [1]"""
_TURN = 180.0 / np.pi


def unit_slip(touches: Touches, stage: Stage, pair: Pair) -> str | None:
    """Name the columns whose unit is another, and which; None where no unit explains the touches.

    Parameters
    ----------
    touches, stage
        As they were read.
    pair
        Both robots with the joints of their touches.
    """
    before = _chi_square(touches, stage)
    if before < _HOPELESS:
        return None
    best, named = _SHARE * (before if np.isfinite(before) else _HOPELESS), None
    for words, mended in _mended(touches, pair):
        after = _chi_square(mended, stage)
        if after < best:
            best, named = after, words
        if best < _FITS:
            break
    return named


def _chi_square(touches: Touches, stage: Stage) -> float:
    """Per degree of freedom; infinite where the registration does not settle."""
    try:
        found: Solution = solve(touches, stage)
    except (NoAnswer, np.linalg.LinAlgError):
        return np.inf
    return found.chi_square / max(found.nu, 1)


def _mended(touches: Touches, pair: Pair) -> Iterator[tuple[str, Touches]]:
    """Every slip of one kind, and the touches without it."""
    readings = touches.readings
    lengths = ("slide", "length")
    columns = {"slide": "slide_mm", "length": "rod_length_mm", "angle": "rod_angle_deg"}
    chosen = [names for n in (1, 2) for names in combinations(lengths, n)]
    for names in [*chosen, ("angle",)]:
        factor, unit = (_TURN, "radians") if names == ("angle",) else (1e3, "metres")
        values = {name: getattr(readings, name) * factor for name in names}
        words = [f"{columns[name]} holds {unit}" for name in names]
        yield " and ".join(words), replace(touches, readings=replace(readings, **values))
    arms = (("master", pair.master, pair.master_joints), ("slave", pair.slave, pair.slave_joints))
    for robot, arm, q in arms:
        slides = np.array(arm.model.prismatic)
        for column, joints, factor, unit in (
            ("j{}_deg", ~slides, _TURN, "radians"),
            ("j{}_mm", slides, 1e3, "metres"),
        ):
            if joints.any():
                listed = ", ".join(column.format(j + 1) for j in np.flatnonzero(joints))
                mended = _with_joints(touches, arm, np.where(joints, q * factor, q), robot)
                yield f"{listed} of the {robot} hold {unit}", mended


def _with_joints(touches: Touches, arm: Arm, q: Float[Array, "_ _"], robot: str) -> Touches:
    """The touches with other joints for one robot; the tips' covariance stays."""
    poses = touches.needle_poses.copy()
    poses[touches.by_slave == (robot == "slave")] = arm.needle_poses(q)
    return replace(touches, needle_poses=poses)

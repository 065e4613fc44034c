"""Verification on new poses: what the robot misses with nominal joints and with compensated ones.

Both cases are judged in the frame that a user of the respective model would have: the nominal
robot with its own best-fitted base and tool, the calibrated robot with the identified ones. So the
figures before and after differ by the model alone: its links, and its effects where it has any.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.calibrated import CalibratedRobot
from robocal.compensated_effects import compensate_robot
from robocal.compensation import nominal_in_cell
from robocal.errors import NoAnswer
from robocal.identification.frames_start import start_frames
from robocal.identification.observations import position_rows
from robocal.kinematics.forward import forward_kinematics
from robocal.measurements import unmeasured_rows
from robocal.planning.candidates import UNBOUND, draw_candidates
from robocal.planning.cell import Cell
from robocal.reach import Reach

_MOST_DRAWN = 50
"""Random targets per target wanted after which the calibrated robot counts as unable"""


@dataclass(frozen=True)
class VerificationPlan:
    """Targets to visit twice."""

    q_nominal: Float[Array, "target joint"]
    """Joints that the nominal robot needs [rad or m]."""
    q_compensated: Float[Array, "target joint"]
    """Joints that bring the calibrated robot to the same flange poses."""


@dataclass(frozen=True)
class PoseAccuracy:
    """Distance between reached and wanted target positions."""

    targets: int
    position_rms: float
    """[m]"""
    position_mean: float
    position_max: float
    errors: Float[Array, "target"]


def plan_verification(
    calibrated: CalibratedRobot,
    count: int,
    seed: int,
    payload: float = float("nan"),
    temperature: float = float("nan"),
    cell: Cell = UNBOUND,
) -> VerificationPlan:
    """Random admissible targets, not measured before, and the joints for both ways.

    Parameters
    ----------
    payload, temperature
        At the verification [kg], [degC], for a model with effects that depend on them.
    cell
        What bounds the targets; the robot's joint limits bound both ways to them.

    Raises
    ------
    NoAnswer
        If compensation reaches hardly any target within the joint limits.
    BadInput
        If the model has an effect of something that is not known here.
    """
    robot = calibrated.robot
    rng = np.random.default_rng(seed)
    nominal: list[Float[Array, "joint"]] = []
    compensated: list[Float[Array, "joint"]] = []
    for _ in range(_MOST_DRAWN):
        q = draw_candidates(robot, count, rng, cell)
        rows = unmeasured_rows(q, payload, temperature)
        solution = compensate_robot(calibrated, wanted_poses(calibrated, q), rows, q, in_base=False)
        for before, after, reach in zip(q, solution.q, solution.reach, strict=True):
            if reach is Reach.reached and len(nominal) < count:
                nominal.append(before)
                compensated.append(after)
        if len(nominal) == count:
            return VerificationPlan(np.array(nominal), np.array(compensated))
    raise NoAnswer(
        f"{robot.name}: of {_MOST_DRAWN * count} random targets only {len(nominal)} can be reached "
        f"with compensated joints within the joint limits, {count} are wanted; identify again"
    )


def wanted_poses(
    calibrated: CalibratedRobot, q_nominal: Float[Array, "target joint"]
) -> Float[Array, "target 4 4"]:
    """Where the nominal robot, in the identified base and with the identified tool, would be."""
    return forward_kinematics(nominal_in_cell(calibrated), q_nominal)


def accuracy_after(
    calibrated: CalibratedRobot,
    q_nominal: Float[Array, "target joint"],
    measured: Float[Array, "target 3"],
) -> PoseAccuracy:
    """Accuracy of the calibrated robot, driven with compensated joints.

    Parameters
    ----------
    q_nominal
        Nominal joints of the targets, which state what was wanted [rad or m].
    measured
        Where the tracker saw the target after driving to the compensated joints [m].
    """
    return _accuracy(measured - wanted_poses(calibrated, q_nominal)[:, :3, 3])


def accuracy_before(
    calibrated: CalibratedRobot,
    q_nominal: Float[Array, "target joint"],
    measured: Float[Array, "target 3"],
) -> PoseAccuracy:
    """Accuracy of the nominal robot, its base and tool fitted to these very targets.

    Parameters
    ----------
    q_nominal
        Joints that were driven [rad or m].
    measured
        Where the tracker saw the target [m].
    """
    rows = position_rows(q_nominal, measured, 1e-3)
    geometry = calibrated.robot.geometry
    frames = start_frames(geometry, rows)
    model = geometry.with_frames(frames.base, geometry.flange @ frames.tool)
    return _accuracy(measured - forward_kinematics(model, q_nominal)[:, :3, 3])


def _accuracy(miss: Float[Array, "target 3"]) -> PoseAccuracy:
    errors = np.linalg.norm(miss, axis=1)
    return PoseAccuracy(
        targets=len(errors),
        position_rms=float(np.sqrt(np.mean(errors**2))),
        position_mean=float(errors.mean()),
        position_max=float(errors.max()),
        errors=errors,
    )


def accuracy_document(accuracy: PoseAccuracy) -> dict[str, object]:
    """In mm."""
    return {
        "targets": accuracy.targets,
        "position_rms_mm": accuracy.position_rms * 1e3,
        "position_mean_mm": accuracy.position_mean * 1e3,
        "position_max_mm": accuracy.position_max * 1e3,
        "errors_mm": [float(error) * 1e3 for error in accuracy.errors],
    }

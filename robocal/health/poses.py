"""Poses of a health check, and poses that tell two explanations apart."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.calibrated import CalibratedRobot
from robocal.errors import BadInput
from robocal.health.check import Alternative
from robocal.health.movements import derivatives, moved, movements
from robocal.kinematics.forward import forward_kinematics
from robocal.planning.candidates import UNBOUND, draw_candidates
from robocal.planning.cell import Cell

_CANDIDATES = 400
FEWEST = 4
"""Poses with which base, tool and any joint can be told apart at all"""
DISCRIMINATING = 4
_NOISE = 5e-5
"""What a movement is compared with in the choice of poses [m]"""


def health_poses(
    calibrated: CalibratedRobot, count: int, seed: int, cell: Cell = UNBOUND
) -> Float[Array, "pose joint"]:
    """Admissible poses that together show every movement best, chosen one after the other.

    Raises
    ------
    BadInput
        If fewer poses are wanted than tell the movements apart.
    """
    if count < FEWEST:
        raise BadInput("poses", f"{count} do not tell base, tool and joints apart; {FEWEST} do")
    q = draw_candidates(calibrated.robot, _CANDIDATES, np.random.default_rng(seed), cell)
    model = calibrated.model.with_frames_as_origin()
    columns = [
        derivatives(model, movement, q) * movement.sizes / _NOISE
        for movement in movements(model.n_joints, None)
    ]
    per_pose = np.concatenate(columns, axis=1).reshape(len(q), 3, -1)
    information = np.eye(per_pose.shape[2])
    chosen: list[int] = []
    for _ in range(count):
        # det(M + AᵀA) = det(M) det(I + A M⁻¹ Aᵀ): three by three for every candidate.
        inner = per_pose @ np.linalg.inv(information) @ per_pose.transpose(0, 2, 1)
        gain = np.linalg.slogdet(np.eye(3) + inner)[1]
        gain[chosen] = -np.inf
        best = int(np.argmax(gain))
        chosen.append(best)
        information = information + per_pose[best].T @ per_pose[best]
    return np.asarray(q[chosen])


def discriminating_poses(
    calibrated: CalibratedRobot, first: Alternative, second: Alternative, seed: int
) -> tuple[Float[Array, "pose joint"], Float[Array, "pose"]]:
    """Poses at which two explanations differ most, and by how much there [m]."""
    q = draw_candidates(calibrated.robot, _CANDIDATES, np.random.default_rng(seed))
    model = calibrated.model.with_frames_as_origin()
    at = [
        forward_kinematics(moved(model, one.movement, one.numbers), q)[:, :3, 3]
        for one in (first, second)
    ]
    difference = np.linalg.norm(at[0] - at[1], axis=1)
    best = np.argsort(-difference)[:DISCRIMINATING]
    return q[best], difference[best]

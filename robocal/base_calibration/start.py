"""Closed-form start: each robot sees the stage as a known flat figure, and the two views agree."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.base_calibration.corrections import N_CORRECTIONS
from robocal.base_calibration.stage import cup_positions
from robocal.base_calibration.state import State, frame_of
from robocal.base_calibration.touches import Touches
from robocal.errors import NoAnswer
from robocal.frames import invert, nearest_rotation

COLLINEAR = 1e-3
"""Points count as lying on a line when they leave it by less than this share of its length; [1]"""
_UP = np.array([0.0, 0.0, 1.0])


def closed_form_start(touches: Touches) -> State:
    """Frames from the touches alone, sensors taken at their word.

    A robot whose touches lie on one line leaves the turn about it open; the stage is then taken to
    stand as upright in that robot's base as the line allows.

    Raises
    ------
    NoAnswer
        If no placement of the stage has two touches by each robot at different places.

    References
    ----------
    .. [1] S. Umeyama, "Least-squares estimation of transformation parameters between two point
       patterns", IEEE PAMI 13(4), 1991.
    """
    cups = cup_positions(
        touches.readings,
        touches.on_rod,
        np.zeros(N_CORRECTIONS),
        np.broadcast_to(_UP, (len(touches), 3)),
        touches.rod_reference,
    )
    slave = _slave_frame(touches, cups)
    tips = touches.tips.copy()
    tips[touches.by_slave] = tips[touches.by_slave] @ slave[:3, :3].T + slave[:3, 3]
    stages = []
    for placement in range(touches.n_placements):
        here = touches.placement == placement
        master = here & ~touches.by_slave
        upright = _UP if master.any() else slave[:3, 2]
        stages.append(align(cups[here], tips[here], upright))
    return State(np.array(stages), slave, np.zeros(N_CORRECTIONS))


def _slave_frame(touches: Touches, cups: Float[Array, "touch 3"]) -> Float[Array, "4 4"]:
    """From the placement that both robots touched most widely."""
    best, widest = None, -1.0
    for placement in range(touches.n_placements):
        here = touches.placement == placement
        sides = [here & touches.by_slave, here & ~touches.by_slave]
        if min(side.sum() for side in sides) < 2:
            continue
        spreads = [_spread(cups[side]) for side in sides]
        if min(along for along, _ in spreads) == 0.0:
            continue
        # Width off the line first; length only decides between placements that have none.
        width = min(across + 1e-6 * along for along, across in spreads)
        if width > widest:
            best, widest = placement, width
    if best is None:
        raise NoAnswer(
            "the stage needs at least two touches by the master and two by the slave, at different "
            "cup places and without moving the stage between them"
        )
    here = touches.placement == best
    views = [
        align(cups[side], touches.tips[side], _UP)
        for side in (here & ~touches.by_slave, here & touches.by_slave)
    ]
    return np.asarray(views[0] @ invert(views[1]))


def _spread(points: Float[Array, "point 3"]) -> tuple[float, float]:
    """Extent along the points' main line, and across it [m]."""
    values = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return float(values[0]), float(values[1])


def align(
    local: Float[Array, "point 3"], seen: Float[Array, "point 3"], up: Float[Array, "3"]
) -> Float[Array, "4 4"]:
    """The frame that carries the `local` points onto the `seen` ones.

    Points on one line leave a turn about it; the frame's z is then put as near to `up` as it goes.
    """
    centre, centre_seen = local.mean(axis=0), seen.mean(axis=0)
    a, b = local - centre, seen - centre_seen
    along, across = _spread(local)
    if across > COLLINEAR * along:
        R = nearest_rotation(b.T @ a)
    else:
        line = np.linalg.svd(a)[2][0]
        line_seen = b.T @ (a @ line)
        R = _upright_frame(line_seen, up) @ _upright_frame(line, _UP).T
    return frame_of(R, centre_seen - R @ centre)


def _upright_frame(line: Float[Array, "3"], up: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """Axes along the line, across it, and as near to `up` as the line allows."""
    x = line / np.linalg.norm(line)
    z = up - (up @ x) * x
    if np.linalg.norm(z) < COLLINEAR:
        z = np.cross(x, np.eye(3)[np.argmin(np.abs(x))])
    z /= np.linalg.norm(z)
    return np.column_stack([x, np.cross(z, x), z])

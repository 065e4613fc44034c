"""Directions of the slave's frame that the touches leave open, in words, and what fixes them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.base_calibration.next_touch import Travel, candidate_touches
from robocal.base_calibration.solution import Solution
from robocal.base_calibration.start import COLLINEAR
from robocal.base_calibration.touches import Touches

_WITHIN = 1e-5
"""A move lies within the open ones when it leaves them by less than this share; [1]"""


@dataclass(frozen=True)
class OpenDirection:
    """One direction left open.

    Parameters
    ----------
    words
        What the slave's base may still do.
    fixed_by
        The touch that would fix it.
    twist
        Shift [m] of the slave's origin and rotation vector [rad], in the master's axes.
    """

    words: str
    fixed_by: str
    twist: Float[Array, "6"]


def open_directions(
    solution: Solution, touches: Touches, travel: Travel
) -> tuple[OpenDirection, ...]:
    """Every open direction of the slave's frame, named where it is a plain turn or shift."""
    basis = slave_null(solution)
    found: list[OpenDirection] = []
    taken = np.zeros((6, 0))
    for words, twist, by_slave in _named_moves(solution, touches):
        if taken.shape[1] == basis.shape[1]:
            break
        unit = twist / np.linalg.norm(twist)
        rest = unit - taken @ (taken.T @ unit)
        if np.linalg.norm(unit - basis @ (basis.T @ unit)) > _WITHIN:
            continue
        if np.linalg.norm(rest) < _WITHIN:
            continue
        taken = np.column_stack([taken, rest / np.linalg.norm(rest)])
        fix = _fixing_touch(solution, touches, travel, twist, by_slave)
        found.append(OpenDirection(words, fix, twist))
    left = np.linalg.svd(basis - taken @ (taken.T @ basis))[0][:, : basis.shape[1] - taken.shape[1]]
    for twist in left.T:
        fix = _fixing_touch(solution, touches, travel, twist, by_slave=True)
        found.append(OpenDirection(_screw_in_words(solution, twist), fix, twist))
    return tuple(found)


def slave_null(solution: Solution) -> Float[Array, "6 open"]:
    """Orthonormal basis of the slave's moves that change no residual."""
    part = solution.null[solution.state.slave_columns]
    U, sigma, _ = np.linalg.svd(part, full_matrices=False)
    return np.asarray(U[:, sigma > _WITHIN])


def _named_moves(solution: Solution, touches: Touches) -> list[tuple[str, Float[Array, "6"], bool]]:
    """Moves that have a name, the likeliest first, and whether a slave's touch would stop them."""
    moves = []
    origin = solution.state.slave[:3, 3]
    for by_slave, robot, points in ((True, "slave", "R1R2"), (False, "master", "P1P2")):
        line = _line_of(solution, touches, touches.by_slave == by_slave)
        if line is not None:
            point, direction, lines = line
            words = (
                f"turn of the slave's base about the line {points} through the {robot}'s touches "
                f"(lines {lines} of the touches)"
            )
            moves.append((words, _turn(point, direction, origin), by_slave))
    for placement, frame in enumerate(solution.state.stages):
        where = f" (placement {placement + 1})" if len(solution.state.stages) > 1 else ""
        names = ("the guide", "the horizontal across the guide", "the rod's axis")
        for axis, name in enumerate(names):
            turn = _turn(frame[:3, 3], frame[:3, axis], origin)
            moves.append((f"turn of the slave's base about {name}{where}", turn, False))
            shift = np.concatenate([frame[:3, axis], np.zeros(3)])
            moves.append((f"shift of the slave's base along {name}{where}", shift, True))
    return moves


def _line_of(
    solution: Solution, touches: Touches, own: Bool[Array, "touch"]
) -> tuple[Float[Array, "3"], Float[Array, "3"], str] | None:
    """Point and direction, in the master's base, of the line that all of a robot's touches lie on.

    As the cups lie, not the tips, which noise takes off the line.
    """
    points = touches.tips[own] - solution.equations.misclosure[own] @ _back(solution, touches, own)
    centre = points.mean(axis=0)
    _, spread, axes = np.linalg.svd(points - centre)
    if len(points) < 2 or (len(spread) > 1 and spread[1] > COLLINEAR * spread[0]):
        return None
    direction = axes[0]
    if touches.by_slave[own].all():
        slave = solution.state.slave
        centre, direction = slave[:3, :3] @ centre + slave[:3, 3], slave[:3, :3] @ direction
    return centre, direction, ", ".join(str(line) for line in touches.lines[own])


def _back(solution: Solution, touches: Touches, own: Bool[Array, "touch"]) -> Float[Array, "3 3"]:
    """Rotation that carries a row in the master's axes into the touching robot's."""
    return solution.state.slave[:3, :3] if touches.by_slave[own].all() else np.eye(3)


def _turn(
    point: Float[Array, "3"], direction: Float[Array, "3"], origin: Float[Array, "3"]
) -> Float[Array, "6"]:
    return np.concatenate([np.cross(direction, origin - point), direction])


def _fixing_touch(
    solution: Solution,
    touches: Touches,
    travel: Travel,
    twist: Float[Array, "6"],
    by_slave: bool,  # noqa: FBT001 - which robot, as in Touches
) -> str:
    """The touch, within reach of what was touched, that the open move would shift most."""
    candidates = candidate_touches(solution, touches, travel)
    own = candidates.by_slave == by_slave
    made = touches.tips[touches.by_slave == by_slave]
    own &= np.linalg.norm(candidates.tips, axis=1) <= np.linalg.norm(made, axis=1).max()
    slave = solution.state.slave
    places = candidates.tips.copy()
    turned = places[candidates.by_slave] @ slave[:3, :3].T + slave[:3, 3]
    places[candidates.by_slave] = turned
    moved = np.linalg.norm(twist[:3] + np.cross(twist[3:], places - slave[:3, 3]), axis=1)
    robot = "slave" if by_slave else "master"
    if not own.any() or moved[own].max() < 1e-3:
        return f"one more touch by the {robot}, off the line or point of its other touches"
    best = int(np.argmax(np.where(own, moved, -1.0)))
    readings = candidates.readings
    where = f"slide {readings.slide[best] * 1e3:.0f} mm"
    if candidates.on_rod[best]:
        where += (
            f", rod angle {np.rad2deg(readings.angle[best]):.0f} deg, "
            f"rod length {readings.length[best] * 1e3:.0f} mm"
        )
    cup = "rod" if candidates.on_rod[best] else "slide"
    return f"a touch by the {robot} of the {cup} cup at {where}"


def _screw_in_words(solution: Solution, twist: Float[Array, "6"]) -> str:
    """A move that has no plainer name."""
    shift, turn = twist[:3], twist[3:]
    rate = np.linalg.norm(turn)
    if rate < _WITHIN:
        along = ", ".join(f"{value:.3f}" for value in shift / np.linalg.norm(shift))
        return f"shift of the slave's base along ({along}) in the master's base"
    axis = turn / rate
    point = solution.state.slave[:3, 3] + np.cross(axis, shift) / rate
    direction, through = (", ".join(f"{v:.3f}" for v in vector) for vector in (axis, point))
    return (
        f"turn of the slave's base about ({direction}) through ({through}) m in the master's base"
    )

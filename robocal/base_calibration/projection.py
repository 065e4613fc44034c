r"""The paper's projection method: the touch polyhedra seen along the master's three axes.

X-Y gives the turn about Z and x, y by a chain of triangles; X-Z and Y-Z give x, y and z a second
and a first and second time; the two answers a coordinate are averaged. What the method takes for
granted is checked on the touches, and where it does not hold there is no answer.

Two readings are ours, because the text leaves them out: in the side views a guide that runs along
the master's X or Y axis is taken to run along it exactly (this is what makes the second answers
differ from the first, as they do in the paper's table 4), and the tilts come from the heights of
R1 and R2; the turn about R1R2 is taken as level.

References
----------
.. [1] Zhong et al., Manufacturing Technology & Machine Tool 12 (2022), 20-26, eq. (5)-(11). Its
   |O1e| is printed with O1P1 where the triangle has O1P2; see docs/base_calibration.md.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.base_calibration.assumptions import Assumption, Polyhedron, check_assumptions
from robocal.base_calibration.stage import Stage
from robocal.base_calibration.touches import Touches
from robocal.base_calibration.triangles import corner, side, wrapped
from robocal.frames import frame_from_xyz_ypr

_ALONG_AXIS = 1e-3
"""Angle within which the guide counts as parallel to an axis of the master [rad]"""


@dataclass(frozen=True)
class Projection:
    """The projection method's answer, or why there is none.

    Parameters
    ----------
    transform
        The slave's base in the master's base; None where an assumption fails.
    assumptions
        Each with what the touches say of it.
    first, second
        x, y, z [m] in the views where they are met first and second: x in X-Y and X-Z, y in X-Y
        and Y-Z, z in X-Z and Y-Z; None where there is no answer.
    refusal
        One sentence; empty where there is an answer.
    """

    transform: Float[Array, "4 4"] | None
    assumptions: tuple[Assumption, ...]
    first: Float[Array, "3"] | None
    second: Float[Array, "3"] | None
    refusal: str


def project(touches: Touches, stage: Stage) -> Projection:
    """The polyhedron method on the first suitable two touches of each robot."""
    figure, assumptions = check_assumptions(touches, stage)
    failed = [entry for entry in assumptions if not entry.holds]
    if figure is None or failed:
        refusal = "no answer by projection: " + "; ".join(entry.finding for entry in failed)
        return Projection(None, assumptions, None, None, refusal)
    yaw, x, y = _from_above(figure)
    first_side, second_side = _from_the_sides(figure, yaw)
    roll, pitch = _tilts(figure, yaw)
    first = np.array([x, y, first_side[2]])
    second = np.array([first_side[0], second_side[1], second_side[2]])
    transform = frame_from_xyz_ypr(np.array([*(0.5 * (first + second)), yaw, pitch, roll]))
    return Projection(transform, assumptions, first, second, "")


def _from_above(figure: Polyhedron) -> tuple[float, float, float]:
    """Turn about Z [rad] and x, y [m] of the slave's base, from the X-Y view."""
    p1, p2 = figure.master_polar
    r1, r2 = figure.slave_polar
    op1, op2 = np.hypot(*figure.master[:, :2].T)
    or1, or2 = np.hypot(*figure.slave[:, :2].T)
    ahead = np.sign(wrapped(p2 - p1))
    turn_p, turn_r = abs(wrapped(p2 - p1)), abs(wrapped(r2 - r1))
    p1p2 = side(op1, op2, turn_p)
    c1 = corner(op1, p1p2, op2)
    back = p1 + ahead * (np.pi - c1) + np.pi
    travel = figure.travel * np.cos(figure.climb)
    c13 = c1 + turn_p if travel > 0 else np.pi - c1 - turn_p
    o1e = side(op2, abs(travel), c13)
    c10 = corner(abs(travel), o1e, op2)
    e_polar = p2 + np.sign(travel) * ahead * (np.pi - c13 - c10)
    (rod1, rod2), (angle1, angle2) = figure.rods_from_above()
    r1r2 = side(or1, or2, turn_r)
    c6 = corner(r1r2, rod2, rod1)
    c7 = np.pi - corner(or1, r1r2, or2) - turn_r
    at_stage = np.sign(wrapped(angle1 - angle2)) * c6
    at_slave = np.sign(wrapped(r2 - r1)) * c7
    to_e = back - angle2 + np.pi
    yaw = wrapped(to_e + at_stage - (r2 + np.pi + at_slave))
    q = wrapped(at_stage - at_slave)
    o2e = side(rod2, or2, q)
    c8 = np.sign(q) * corner(o2e, rod2, or2)
    c9 = wrapped(back - angle2 - c8 - (e_polar + np.pi))
    o1o2 = side(o1e, o2e, c9)
    c11 = np.sign(c9) * corner(o1o2, o1e, o2e)
    polar = e_polar - c11
    return yaw, float(o1o2 * np.cos(polar)), float(o1o2 * np.sin(polar))


def _from_the_sides(figure: Polyhedron, yaw: float) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
    """The slave's origin [m] as the X-Z view and the Y-Z view put it; each has one blind entry."""
    answers = []
    c, s = np.cos(yaw), np.sin(yaw)
    slave = figure.slave @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    for view in range(2):
        guide = _guide_seen(figure, view)
        across = np.array([-guide[1], guide[0], 0.0]) / np.hypot(guide[0], guide[1])
        e = figure.master[1] + figure.travel * guide
        rods = figure.lengths[:, None] * (
            np.sin(figure.angles)[:, None] * across - np.cos(figure.angles)[:, None] * guide
        )
        answers.append((e + rods - slave).mean(axis=0))
    return answers[0], answers[1]


def _guide_seen(figure: Polyhedron, view: int) -> Float[Array, "3"]:
    """Direction of the guide in the view along Y (0) or along X (1)."""
    guide = figure.guide
    axis = int(np.argmax(np.abs(guide[:2])))
    if abs(guide[1 - axis]) > _ALONG_AXIS or abs(guide[2]) > _ALONG_AXIS:
        return guide
    seen = np.zeros(3)
    seen[axis] = np.sign(guide[axis])
    # Only the view that sees the guide's length sees that it climbs.
    if view == axis:
        seen[2] = guide[2]
    return seen


def _tilts(figure: Polyhedron, yaw: float) -> tuple[float, float]:
    """Roll and pitch [rad] from the heights of R1 and R2, as the stage and the slave have them."""
    along = figure.lengths * np.cos(figure.angles)
    by_stage = (along[1] - along[0]) * np.sin(figure.climb)
    line = figure.slave[0] - figure.slave[1]
    tilt = (by_stage - line[2]) / np.hypot(line[0], line[1])
    heading = np.arctan2(line[1], line[0]) + yaw
    # The turn that lifts a line along h is about h x z.
    return float(tilt * np.sin(heading)), float(-tilt * np.cos(heading))

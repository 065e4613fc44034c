"""Kinematics and gravity of the true arm, by products of elementary 4x4 matrices.

Link convention: Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta); joint i moves theta (revolute) or d
(prismatic). Link i's own frame is the one behind joint i.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.emulators.rigid import Matrix, translation, turn_x, turn_y, turn_z

Vector = NDArray[np.float64]

STANDARD_GRAVITY = 9.80665
"""[m/s2], CGPM 1901."""


@dataclass(frozen=True)
class LinkTable:
    """Link constants of an arm, one entry a joint: lengths [m], angles [rad]."""

    theta: Vector
    d: Vector
    a: Vector
    alpha: Vector
    beta: Vector
    prismatic: tuple[bool, ...]

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return len(self.prismatic)

    def reach(self) -> float:
        """Sum of all link lengths [m], an upper bound of how far the flange can be."""
        return float(np.abs(self.a).sum() + np.abs(self.d).sum())


@dataclass(frozen=True)
class MassPoint:
    """Mass of one body and its centre in the frame that carries it."""

    mass_kg: float
    com: tuple[float, float, float]
    """[m]"""


def link_transform(table: LinkTable, joint: int, q: float) -> Matrix:
    """Transform across one joint and its link, joints counted from 0 here."""
    theta, d = float(table.theta[joint]), float(table.d[joint])
    theta, d = (theta, d + q) if table.prismatic[joint] else (theta + q, d)
    return (
        turn_z(theta)
        @ translation(0.0, 0.0, d)
        @ translation(float(table.a[joint]), 0.0, 0.0)
        @ turn_x(float(table.alpha[joint]))
        @ turn_y(float(table.beta[joint]))
    )


def link_frames(table: LinkTable, q: Vector) -> list[Matrix]:
    """Poses of the base (first), every link, the flange (last) in the base frame."""
    frames = [np.eye(4)]
    for joint in range(table.n_joints):
        frames.append(frames[-1] @ link_transform(table, joint, float(q[joint])))
    return frames


def gravity_loads(
    table: LinkTable, q: Vector, bodies: list[tuple[int, MassPoint]], gravity: Vector
) -> Vector:
    """Generalised force of gravity on every joint: torque [N m], force [N] if prismatic.

    Parameters
    ----------
    table, q
        The arm and its joints.
    bodies
        Each mass with the number of the frame of `link_frames` that carries it.
    gravity
        Acceleration in the base frame [m/s2].
    """
    frames = link_frames(table, q)
    loads = np.zeros(table.n_joints)
    for carrier, body in bodies:
        weight = body.mass_kg * gravity
        centre = (frames[carrier] @ np.array([*body.com, 1.0]))[:3]
        for joint in range(carrier):
            axis, origin = frames[joint][:3, 2], frames[joint][:3, 3]
            pull = weight if table.prismatic[joint] else np.cross(centre - origin, weight)
            loads[joint] += axis @ pull
    return loads

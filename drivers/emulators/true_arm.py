"""Kinematics of the true arm, by products of elementary 4x4 matrices, for one row or many.

Link convention: Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta); joint i moves theta (revolute) or d
(prismatic). Link i's own frame is the one behind joint i. Joints may be a stack of rows, and so may
the link constants: `...` below stands for the rows, none for a single pose.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.emulators.rigid import Matrix, translation, turn_x, turn_y, turn_z

Vector = NDArray[np.float64]

STANDARD_GRAVITY = 9.80665
"""[m/s2], CGPM 1901."""


@dataclass(frozen=True)
class LinkTable:
    """Link constants of an arm, one entry a joint: lengths [m], angles [rad]; (..., joint)."""

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


def link_transform(table: LinkTable, joint: int, q: Vector) -> Matrix:
    """Transform across one joint and its link, joints counted from 0 here."""
    theta, d = table.theta[..., joint], table.d[..., joint]
    theta, d = (theta, d + q) if table.prismatic[joint] else (theta + q, d)
    return np.asarray(
        turn_z(theta)
        @ translation(0.0, 0.0, d)
        @ translation(table.a[..., joint], 0.0, 0.0)
        @ turn_x(table.alpha[..., joint])
        @ turn_y(table.beta[..., joint])
    )


def link_frames(
    table: LinkTable, q: Vector, flexures: Mapping[int, Matrix] | None = None
) -> list[Matrix]:
    """Poses of the base (first), every link, the flange (last) in the base frame.

    Parameters
    ----------
    table, q
        The arm and its joints, (..., joint).
    flexures
        By number of a frame of this list: a small motion in that frame, after which the arm goes
        on.
    """
    bent = flexures or {}
    frames: list[Matrix] = [np.eye(4) @ bent.get(0, np.eye(4))]
    for joint in range(table.n_joints):
        frame = frames[-1] @ link_transform(table, joint, q[..., joint])
        frames.append(frame @ bent[joint + 1] if joint + 1 in bent else frame)
    return frames

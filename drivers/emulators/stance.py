"""The arm at its readings: what it carries there, and under which circumstances it stands."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from drivers.emulators.rigid import Matrix
from drivers.emulators.true_arm import LinkTable, MassPoint, Vector, link_frames


@dataclass(frozen=True)
class Circumstances:
    """Everything besides the joint readings that decides where the target truly is.

    Each is one value, or one a row; `last_motion` and `last_move` have one more axis, the joint.
    """

    time_s: Vector
    """World time [s]."""
    temperature_degc: Vector
    payload_kg: Vector
    readings: Vector
    """How many measurements the tracker has taken before this one."""
    last_motion: Vector
    """Direction in which each joint last moved: -1, 0 (never moved), 1."""
    last_move: Vector
    """How far each joint went in the last move [rad], [m]."""
    speed: Vector
    """Of the leading joint in that move [rad/s]."""
    settled_s: Vector
    """How long the arm has stood [s]."""
    stops: Vector
    """Joints of every place where the arm has stood so far, (stop, joint)."""
    stop: NDArray[np.int_]
    """At which of them it stands, counted from 0."""


@dataclass(frozen=True)
class Load:
    """Masses that the arm carries, each with the number of the link frame that it moves with."""

    bodies: tuple[tuple[int, MassPoint], ...]
    payload_frame: int
    payload_com: tuple[float, float, float]
    """Centre of the payload in the flange frame [m]."""
    gravity: tuple[float, float, float]
    """Acceleration in the base frame [m/s2]."""


@dataclass(frozen=True)
class Stance:
    """The arm at its readings, not yet bent by anything."""

    table: LinkTable
    load: Load
    q: Vector
    now: Circumstances

    @cached_property
    def frames(self) -> list[Matrix]:
        """Base, every link, flange in the base frame."""
        return link_frames(self.table, self.q)

    def weight(self, behind: int) -> Vector:
        """Weight of payload and links that frames from number `behind` on carry [N], (..., 3)."""
        links = sum(body.mass_kg for carrier, body in self.load.bodies if carrier >= behind)
        mass = np.asarray(self.now.payload_kg, dtype=float) + links
        return np.asarray(mass[..., None] * np.array(self.load.gravity))

    def moment(self, about: int, behind: int) -> Vector:
        """Moment of that weight about the origin of frame `about` [N m], (..., 3), base axes."""
        gravity = np.array(self.load.gravity)
        origin = self.frames[about][..., :3, 3]
        hand = self._centre(self.load.payload_frame, self.load.payload_com)
        total = np.cross(
            hand - origin, np.asarray(self.now.payload_kg, dtype=float)[..., None] * gravity
        )
        for carrier, body in self.load.bodies:
            if carrier >= behind:
                centre = self._centre(carrier, body.com)
                total = total + np.cross(centre - origin, body.mass_kg * gravity)
        return np.asarray(total)

    def _centre(self, carrier: int, com: tuple[float, float, float]) -> Vector:
        return np.asarray((self.frames[carrier] @ np.array([*com, 1.0]))[..., :3])

    @cached_property
    def loads(self) -> Vector:
        """Gravity's torque about every joint [N m], force [N] if prismatic; (..., joint)."""
        return np.stack([self._load(joint) for joint in range(self.table.n_joints)], axis=-1)

    def _load(self, joint: int) -> Vector:
        axis = self.frames[joint][..., :3, 2]
        behind = joint + 1
        pull = self.weight(behind) if self.table.prismatic[joint] else self.moment(joint, behind)
        return np.asarray((axis * pull).sum(axis=-1))

    @cached_property
    def payload_loads(self) -> Vector:
        """The payload's part of `loads`."""
        load = Load((), self.load.payload_frame, self.load.payload_com, self.load.gravity)
        return Stance(self.table, load, self.q, self.now).loads

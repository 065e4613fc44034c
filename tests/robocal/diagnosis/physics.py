"""What every effect does to the target, from elementary matrices: no code of robocal.

Each function takes an arm, the rows' circumstances as plain arrays, a joint and one coefficient
and gives the target poses. Torques are differences of the potential energy.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.elementary_kinematics import Arm, shift, turn

G = 9.80665
SMALL = 1e-5


@dataclass(frozen=True)
class Load:
    """Masses of the links with their centres in the links' own frames, and of the payload."""

    mass: np.ndarray
    centre: np.ndarray
    payload: np.ndarray
    down: np.ndarray


@dataclass(frozen=True)
class Rows:
    """What was going on."""

    q: np.ndarray
    previous: np.ndarray
    approach: np.ndarray
    time: np.ndarray
    temperature: np.ndarray
    speed: np.ndarray
    load: Load


def link_frames(arm: Arm, q: np.ndarray) -> list[np.ndarray]:
    """Frame after every link, in the robot base."""
    T, frames = np.broadcast_to(np.eye(4), (len(q), 4, 4)), []
    for (theta, d, a, alpha, beta), reading in zip(arm.links, q.T, strict=True):
        T = T @ turn("z", theta + reading) @ shift("z", d) @ shift("x", a)
        T = T @ turn("x", alpha) @ turn("y", beta)
        frames.append(T)
    return frames


def places(arm: Arm, rows: Rows, q: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Mass and place of every link and of the payload, in the robot base."""
    frames = link_frames(arm, q)
    found = [
        (np.full(len(q), mass), (T @ np.append(centre, 1.0))[:, :3])
        for mass, centre, T in zip(rows.load.mass, rows.load.centre, frames, strict=True)
    ]
    return [*found, (rows.load.payload, (frames[-1] @ arm.tool)[:, :3, 3])]


def torque(arm: Arm, rows: Rows, joint: int, *, links: bool = True) -> np.ndarray:
    """Minus the derivative of the potential energy by the joint [Nm]."""

    def work(q: np.ndarray) -> np.ndarray:
        every = places(arm, rows, q)
        return sum(G * m * (p @ rows.load.down) for m, p in (every if links else every[-1:]))

    step = np.zeros(rows.q.shape[1])
    step[joint - 1] = SMALL
    return (work(rows.q + step) - work(rows.q - step)) / (2 * SMALL)


def moment(arm: Arm, rows: Rows, behind: int, about: np.ndarray) -> np.ndarray:
    """Moment of the weight behind a link about points of the base [Nm]."""
    every = places(arm, rows, rows.q)[behind:]
    return sum(np.cross(p - about, G * m[:, None] * rows.load.down) for m, p in every)


def turned(arm: Arm, rows: Rows, joint: int, angle: np.ndarray) -> np.ndarray:
    """Poses with one joint off by an angle."""
    q = rows.q.copy()
    q[:, joint - 1] += angle
    return arm.poses(q)


def small_turn(vector: np.ndarray) -> np.ndarray:
    """Rotation by small rotation vectors."""
    return turn("x", vector[:, 0]) @ turn("y", vector[:, 1]) @ turn("z", vector[:, 2])


def moved(p: np.ndarray) -> np.ndarray:
    """Translations."""
    return shift("x", p[:, 0]) @ shift("y", p[:, 1]) @ shift("z", p[:, 2])


def bent(arm: Arm, rows: Rows, joint: int, c: float, *, by_end_moment: bool = False) -> np.ndarray:
    """A beam whose curvature is the load's moment over EI = L / c, integrated along it.

    By the end moment alone where the moment all along is the one at the tip.
    """
    T = np.broadcast_to(np.eye(4), (len(rows.q), 4, 4))
    nodes, weights = np.polynomial.legendre.leggauss(4)
    for link, ((theta, d, a, alpha, beta), reading) in enumerate(
        zip(arm.links, rows.q.T, strict=True), start=1
    ):
        T = T @ turn("z", theta + reading) @ shift("z", d)
        if link == joint:
            slope, sag = np.zeros((2, len(rows.q), 3))
            for share, weight in zip(0.5 + 0.5 * nodes, 0.5 * weights, strict=True):
                here = (T @ shift("x", a * (1.0 if by_end_moment else share)))[:, :3, 3]
                M = np.einsum("mji,mj->mi", T[:, :3, :3], moment(arm, rows, joint, here)) * c
                M[:, 0] = 0.0
                slope = slope + weight * M
                sag = sag + weight * a * (1 - share) * np.cross(M, [1.0, 0.0, 0.0])
            T = T @ shift("x", a) @ moved(sag) @ small_turn(slope)
        else:
            T = T @ shift("x", a)
        T = T @ turn("x", alpha) @ turn("y", beta)
    return arm.base @ T @ arm.tool


def tilted(arm: Arm, rows: Rows, joint: int, c: float) -> np.ndarray:
    """The base turns about its horizontal axes."""
    M = c * moment(arm, rows, 0, np.zeros(3))
    M[:, 2] = 0.0
    T = small_turn(M) @ link_frames(arm, rows.q)[-1]
    return arm.base @ T @ arm.tool


def grown(arm: Arm, rows: Rows, share: np.ndarray) -> np.ndarray:
    """Every length longer by a share."""
    T = np.broadcast_to(arm.base, (len(rows.q), 4, 4))
    for (theta, d, a, alpha, beta), reading in zip(arm.links, rows.q.T, strict=True):
        T = T @ turn("z", theta + reading) @ shift("z", d * (1 + share))
        T = T @ shift("x", a * (1 + share)) @ turn("x", alpha) @ turn("y", beta)
    return T @ arm.tool


def circled(arm: Arm, rows: Rows, joint: int, c: float) -> np.ndarray:
    """The instrument's azimuth is off by c cos 2 az: the seen point turns about its vertical."""
    T = arm.poses(rows.q)
    azimuth = np.arctan2(T[:, 1, 3], T[:, 0, 3])
    seen = T.copy()
    seen[:, :3, 3] = (turn("z", c * np.cos(2 * azimuth)) @ T[:, :, 3:])[:, :3, 0]
    return seen


def share_of_time(rows: Rows) -> np.ndarray:
    """Zero to one over the campaign."""
    return (rows.time - rows.time[0]) / (rows.time[-1] - rows.time[0])


STEP_ROW = 10
TAU = 300.0
TAKEN_UP = 5.0

Effect = Callable[[Arm, Rows, int, float], np.ndarray]
PHYSICS: dict[str, Effect] = {
    "joint_compliance": lambda arm, rows, j, c: turned(arm, rows, j, c * torque(arm, rows, j)),
    "payload_compliance": lambda arm, rows, j, c: turned(
        arm, rows, j, c * torque(arm, rows, j, links=False)
    ),
    "link_bending": bent,
    "base_compliance": tilted,
    "gear_harmonic": lambda arm, rows, j, c: turned(
        arm, rows, j, c * np.cos(7.0 * rows.q[:, j - 1])
    ),
    "encoder_gain": lambda arm, rows, j, c: turned(arm, rows, j, c * rows.q[:, j - 1]),
    "joint_coupling": lambda arm, rows, j, c: turned(arm, rows, j, c * rows.q[:, j - 2]),
    "backlash": lambda arm, rows, j, c: turned(arm, rows, j, -c / 2 * rows.approach[:, j - 1]),
    "load_backlash": lambda arm, rows, j, c: turned(
        arm, rows, j, c / 2 * np.maximum(np.minimum(torque(arm, rows, j) / TAKEN_UP, 1.0), -1.0)
    ),
    "settling": lambda arm, rows, j, c: turned(
        arm, rows, j, -c * (rows.q - rows.previous)[:, j - 1] * rows.speed / rows.speed.mean()
    ),
    "thermal_expansion": lambda arm, rows, j, c: grown(
        arm, rows, c * (rows.temperature - rows.temperature.mean())
    ),
    "joint_thermal_drift": lambda arm, rows, j, c: turned(
        arm, rows, j, c * (rows.temperature - rows.temperature.mean())
    ),
    "warm_up": lambda arm, rows, j, c: grown(
        arm, rows, c * (1 - np.exp(-(rows.time - rows.time[0]) / TAU))
    ),
    "base_drift": lambda arm, rows, j, c: (
        arm.base @ shift("x", c * share_of_time(rows)) @ np.linalg.inv(arm.base) @ arm.poses(rows.q)
    ),
    "base_step": lambda arm, rows, j, c: (
        arm.base
        @ shift("x", c * (np.arange(len(rows.q)) >= STEP_ROW))
        @ np.linalg.inv(arm.base)
        @ arm.poses(rows.q)
    ),
    "tool_step": lambda arm, rows, j, c: (
        arm.poses(rows.q) @ shift("x", c * (np.arange(len(rows.q)) >= STEP_ROW))
    ),
    "encoder_step": lambda arm, rows, j, c: turned(
        arm, rows, j, c * (np.arange(len(rows.q)) >= STEP_ROW)
    ),
    "instrument_scale": lambda arm, rows, j, c: scaled(arm, rows, c),
    "instrument_angle": circled,
}


def scaled(arm: Arm, rows: Rows, c: float) -> np.ndarray:
    """Every seen place farther by a share."""
    T = arm.poses(rows.q).copy()
    T[:, :3, 3] *= 1 + c
    return T

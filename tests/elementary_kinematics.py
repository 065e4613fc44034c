"""Forward kinematics as a product of elementary 4 x 4 matrices: the oracle, no code of robocal.

It reads the robots' files itself, so that a wrong reading of them shows too.
"""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import yaml

ROBOTS = Path(__file__).parents[1] / "robocal" / "robots"
ROBOT_NAMES = tuple(sorted(path.stem for path in ROBOTS.glob("*.yaml")))


def turn(axis: str, angle) -> np.ndarray:
    """Rotation about a coordinate axis by one angle or many."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    T = np.zeros((*np.shape(angle), 4, 4))
    T[...] = np.eye(4)
    T[..., i, i] = T[..., j, j] = c
    T[..., i, j], T[..., j, i] = -s, s
    return T


def shift(axis: str, length) -> np.ndarray:
    """Translation along a coordinate axis by one length or many."""
    T = np.zeros((*np.shape(length), 4, 4))
    T[...] = np.eye(4)
    T[..., "xyz".index(axis), 3] = length
    return T


def frame(xyz_ypr) -> np.ndarray:
    """Trans(x, y, z) Rz(yaw) Ry(pitch) Rx(roll)."""
    x, y, z, yaw, pitch, roll = xyz_ypr
    place = shift("x", x) @ shift("y", y) @ shift("z", z)
    return place @ turn("z", yaw) @ turn("y", pitch) @ turn("x", roll)


def random_frame(rng: np.random.Generator, size: float) -> np.ndarray:
    """Any orientation, anywhere within a cube."""
    return frame([*rng.uniform(-size, size, 3), *rng.uniform(-np.pi, np.pi, 3)])


@dataclass(frozen=True)
class Arm:
    """A serial arm; rows of `links` are theta, d, a, alpha, beta [rad, m]."""

    links: np.ndarray
    prismatic: np.ndarray
    limits: np.ndarray
    base: np.ndarray = field(default_factory=lambda: np.eye(4))
    tool: np.ndarray = field(default_factory=lambda: np.eye(4))

    def poses(self, q: np.ndarray) -> np.ndarray:
        """Target poses at joint readings, one a row [rad or m]."""
        T = np.broadcast_to(self.base, (len(q), 4, 4))
        for (theta, d, a, alpha, beta), slides, reading in zip(
            self.links, self.prismatic, q.T, strict=True
        ):
            angle = theta + (0.0 if slides else reading)
            offset = d + (reading if slides else 0.0)
            T = T @ turn("z", angle + np.zeros(len(q))) @ shift("z", offset + np.zeros(len(q)))
            T = T @ shift("x", a) @ turn("x", alpha) @ turn("y", beta)
        return T @ self.tool

    def draw(self, rng: np.random.Generator, count: int, widest: float = np.pi) -> np.ndarray:
        """Joint readings uniform within the limits, revolute ones within `widest` either way."""
        low, high = self.limits.T
        low = np.where(self.prismatic, low, np.maximum(low, -widest))
        high = np.where(self.prismatic, high, np.minimum(high, widest))
        return rng.uniform(low, high, (count, len(low)))

    def units(self) -> np.ndarray:
        """SI units in one unit of the files, joint by joint."""
        return np.where(self.prismatic, 1e-3, np.pi / 180)

    def within(self, base: np.ndarray, tool: np.ndarray) -> "Arm":
        """The same arm with other frames."""
        return replace(self, base=base, tool=tool)


def arm_from_document(document: dict) -> Arm:
    """An arm from the content of a robot.yaml in MDH convention."""
    rows = document["joints"]
    deg = np.pi / 180
    links = [
        (r["theta_deg"] * deg, r["d_mm"] / 1e3, r["a_mm"] / 1e3, r["alpha_deg"] * deg,
         r["beta_deg"] * deg)
        for r in rows
    ]  # fmt: skip
    prismatic = np.array([r["type"] == "prismatic" for r in rows])
    limits = [
        np.array(r["limits_mm"]) / 1e3 if "limits_mm" in r else np.array(r["limits_deg"]) * deg
        for r in rows
    ]
    return Arm(np.array(links), prismatic, np.array(limits))


def load_arm(name: str) -> Arm:
    """One of the project's robots."""
    return arm_from_document(yaml.safe_load((ROBOTS / f"{name}.yaml").read_text()))

"""A campaign: the true arm, its poses and what goes on while it is measured."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tests.second_world.arm import (
    N,
    applied,
    frames,
    moment_about,
    read_arm,
    rotation,
    torques,
    turn,
)

ROBOT = Path(__file__).parents[1] / "blind" / "robots" / "staubli_tx60_with_masses.yaml"
SIGMA = 0.03e-3
N_FIT, N_CHECK = 120, 40
PAYLOADS = {0.0: 54, 2.0: 53, 4.0: 53}
"""Rows with each [kg]."""
STEP_S = 60.0
WARMER_K = 15.0
H = 1e-6
"""Of the differences [m, rad]."""


@dataclass
class Change:
    """What effects do to an arm, row by row."""

    rows: int
    joints: np.ndarray = field(init=False)
    growth: np.ndarray = field(init=False)
    tilt: np.ndarray = field(init=False)
    shift: np.ndarray = field(init=False)
    slip: np.ndarray = field(init=False)
    bent: dict[int, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.joints, self.growth = np.zeros((2, self.rows, N))
        self.tilt, self.shift, self.slip = np.zeros((3, self.rows, 3))


@dataclass(frozen=True)
class Place:
    """What the calibration is after: links, the base in the tracker's frame, and the nest."""

    links: np.ndarray
    axes: np.ndarray
    base: np.ndarray
    tool: np.ndarray


class Campaign:
    """Everything but the effects, drawn once."""

    def __init__(self, rng: np.random.Generator) -> None:
        arm = read_arm(ROBOT)
        links = arm.links.copy()
        links[:, [0, 3]] += rng.normal(0, 3e-3, (N, 2))
        links[:, [1, 2]] += rng.normal(0, 0.3e-3, (N, 2))
        links[1, 4] += rng.normal(0, 3e-3)
        # Stated masses and centres are a tenth off; payloads are weighed.
        self.mass = arm.mass * (1 + 0.1 * rng.normal(size=N))
        self.centre = arm.centre * (1 + 0.1 * rng.normal(size=arm.centre.shape))
        self.down = np.array([0.0, 0.0, -1.0])
        self.tool_guess = np.array([0.060, 0.025, 0.110])
        tool = self.tool_guess + rng.normal(0, 0.5e-3, 3)
        self.payload_centre = self.tool_guess * (1 + 0.1 * rng.normal(size=3))
        self._stand(rng, links, tool)
        self._go(rng, arm.limits)
        self.noise = rng.normal(0, SIGMA, (self.n, 3))
        self._load()

    def _stand(self, rng: np.random.Generator, links: np.ndarray, tool: np.ndarray) -> None:
        """The robot stands 1.5 to 3 m from the tracker, its foot up to 1 m below; both levelled."""
        distance = rng.uniform(1.5, 3.0)
        azimuth, yaw = rng.uniform(-np.pi, np.pi), rng.uniform(-np.pi, np.pi)
        below = rng.uniform(0, 1.0)
        flat = np.sqrt(distance**2 - below**2)
        base = np.array([flat * np.cos(azimuth), flat * np.sin(azimuth), -below])
        ypr = np.array([yaw, *rng.normal(0, 3e-3, 2)])
        R = rotation(2, ypr[0]) @ rotation(1, ypr[1]) @ rotation(0, ypr[2])
        self.place = Place(links, R, base, tool)
        self.base_guess = base + rng.normal(0, 5e-3, 3)
        self.ypr_guess = ypr + rng.normal(0, 5e-3, 3)

    def _go(self, rng: np.random.Generator, limits: np.ndarray) -> None:
        """Poses over the whole range, one a minute, in blocks of one payload; the arm warms up."""
        self.n = n = N_FIT + N_CHECK
        q = rng.uniform(limits[:, 0], limits[:, 1], (n, N))
        # The file keeps seven decimals of a degree: these are the truth.
        self.q = np.deg2rad(np.round(np.rad2deg(q), 7))
        self.check = np.zeros(n, dtype=bool)
        self.check[rng.permutation(n)[:N_CHECK]] = True
        self.payload = np.repeat(list(PAYLOADS), list(PAYLOADS.values()))
        self.time = np.round(STEP_S * np.arange(n) + rng.uniform(-5, 5, n) + 5, 1)
        self.elapsed = (self.time - self.time[0]) / (self.time[-1] - self.time[0])
        self.warmer = WARMER_K * (1 - np.exp(-3 * self.elapsed)) / (1 - np.exp(-3))
        self.temperature = np.round(20 + self.warmer + rng.normal(0, 0.05, n), 2)
        self.move = self.q - np.vstack([np.zeros(N), self.q[:-1]])
        self.approach = np.sign(self.move).astype(int)

    def _load(self) -> None:
        """Weights and what they bring about, at the readings."""
        R, o = self.R, self.o = frames(self.place.links, self.q, np.zeros((self.n, N)), {})
        centres = [o[:, i + 1] + R[:, i + 1] @ self.centre[i] for i in range(N)]
        where = np.stack([*centres, o[:, N] + R[:, N] @ self.payload_centre], axis=1)
        mass = np.column_stack([np.tile(self.mass, (self.n, 1)), self.payload])
        self.where, self.weights = where, mass
        self.torque = torques(R, o, where, mass, self.down)
        bare = np.column_stack([mass[:, :N], np.zeros(self.n)])
        self.payload_torque = self.torque - torques(R, o, where, bare, self.down)
        self.overturning = moment_about(o[:, 0], where, mass, self.down, 0)

    def positions(self, change: Change | None = None, place: Place | None = None) -> np.ndarray:
        """The nest in the tracker's frame."""
        change, place = change or Change(self.n), place or self.place
        R, o = frames(place.links, self.q + change.joints, change.growth, change.bent)
        p = o[:, N] + applied(R[:, N], place.tool + change.slip)
        return applied(turn(change.tilt), p) @ place.axes.T + place.base + change.shift

    def left_by_geometry(self, error: np.ndarray) -> np.ndarray:
        """What links, base and tool cannot take up of an error of the fitted rows."""
        columns = []
        for place, other in zip(self._places(H), self._places(-H), strict=True):
            difference = self.positions(place=place) - self.positions(place=other)
            columns.append(difference[~self.check].ravel() / (2 * H))
        X = np.array(columns).T
        U, s, _ = np.linalg.svd(X / np.linalg.norm(X, axis=0), full_matrices=False)
        U = U[:, s > 1e-7 * s[0]]
        x = error[~self.check].ravel()
        return x - U @ (U.T @ x)

    def _places(self, h: float) -> list[Place]:
        links, R, base, tool = (getattr(self.place, f) for f in ("links", "axes", "base", "tool"))
        changed = []
        for k in range(links.size):
            other = links.copy()
            other.flat[k] += h
            changed.append(Place(other, R, base, tool))
        for d in h * np.eye(3):
            changed.append(Place(links, R, base + d, tool))
            changed.append(Place(links, turn(d) @ R, base, tool))
            changed.append(Place(links, R, base, tool + d))
        return changed

"""One hidden effect, and by what its numbers are drawn."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.second_world.arm import N
from tests.second_world.campaign import Campaign, Change

Act = Callable[[Campaign, Change], None]


@dataclass(frozen=True)
class Hidden:
    """One effect as it was drawn."""

    effect: str
    act: Act
    joint: int | None = None
    order: float | None = None
    driven_by: int | None = None


@dataclass(frozen=True)
class Draw:
    """By what an effect is drawn."""

    rng: np.random.Generator
    campaign: Campaign
    scale: float
    other: bool

    def size(self, low: float, high: float) -> float:
        """Alike in its logarithm."""
        return self.scale * float(np.exp(self.rng.uniform(np.log(low), np.log(high))))

    def sign(self) -> float:
        """Plus or minus one."""
        return float(self.rng.choice([-1, 1]))

    def direction(self) -> np.ndarray:
        """A unit vector."""
        v = self.rng.normal(size=3)
        return v / np.linalg.norm(v)

    def joint(self, among: tuple[int, ...] = tuple(range(1, N + 1))) -> int:
        """One of these."""
        return int(self.rng.choice(among))

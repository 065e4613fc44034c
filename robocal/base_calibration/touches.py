"""Touches: which robot held its needle in which cup, and what the sensors read then."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.base_calibration.stage import Readings


@dataclass(frozen=True)
class Touches:
    """All touches of one base-to-base calibration, one entry each.

    Parameters
    ----------
    lines
        Line in the file, or a running number from 1; it names the touch in every message.
    by_slave, on_rod
        Which robot and which cup; False means master, and slide cup.
    placement
        Running number from 0 of where the stage stood: moved or turned end for end, it counts on.
    readings
        Of the stage's sensors; zero for angle and length at the slide cup.
    needle_poses
        Needle frames in the touching robot's own base, from its joints; the tip is the origin.
    tip_covariance
        Of all tip positions, three rows a touch, each in its robot's base [m2]. Not block diagonal
        where the robots' parameters are themselves uncertain.
    """

    lines: Int[Array, "touch"]
    by_slave: Bool[Array, "touch"]
    on_rod: Bool[Array, "touch"]
    placement: Int[Array, "touch"]
    readings: Readings
    needle_poses: Float[Array, "touch 4 4"]
    tip_covariance: Float[Array, "coordinate coordinate"]

    def __len__(self) -> int:
        return len(self.lines)

    @property
    def tips(self) -> Float[Array, "touch 3"]:
        """Needle tips in the touching robot's own base [m]."""
        return np.asarray(self.needle_poses[:, :3, 3])

    @property
    def n_placements(self) -> int:
        """How often the stage was set down."""
        return int(self.placement.max(initial=-1)) + 1

    @property
    def two_by_each(self) -> bool:
        """Whether both robots touched at least twice at one placement."""
        return any(
            min((here & self.by_slave).sum(), (here & ~self.by_slave).sum()) >= 2
            for here in (self.placement == placement for placement in range(self.n_placements))
        )

    @property
    def rod_reference(self) -> float:
        """Longest rod that was touched [m]; one metre where the rod cup was never touched."""
        return float(self.readings.length[self.on_rod].max()) if self.on_rod.any() else 1.0

    def only(self, keep: Bool[Array, "touch"]) -> "Touches":
        """The touches where `keep` is True; placements without any are closed up."""
        scalars = np.repeat(keep, 3)
        _, placement = np.unique(self.placement[keep], return_inverse=True)
        return replace(
            self,
            lines=self.lines[keep],
            by_slave=self.by_slave[keep],
            on_rod=self.on_rod[keep],
            placement=placement,
            readings=Readings(
                self.readings.slide[keep], self.readings.angle[keep], self.readings.length[keep]
            ),
            needle_poses=self.needle_poses[keep],
            tip_covariance=self.tip_covariance[np.ix_(scalars, scalars)],
        )

    def reading_groups(self) -> tuple[Int[Array, "touch 3"], Float[Array, "reading"]]:
        """Which touches share one reading, and the kind of each: 0 slide, 1 angle, 2 length.

        A value that stands in several rows of a placement to the last digit was read once, with
        the part clamped: its error is common to them. The figures fall with it.
        """
        index = np.full((len(self), 3), -1)
        kinds: list[int] = []
        columns = (self.readings.slide, self.readings.angle, self.readings.length)
        for kind, values in enumerate(columns):
            seen: dict[tuple[int, float], int] = {}
            for touch in range(len(self)):
                if kind > 0 and not self.on_rod[touch]:
                    continue
                key = (int(self.placement[touch]), float(values[touch]))
                if key not in seen:
                    seen[key] = len(kinds)
                    kinds.append(kind)
                index[touch, kind] = seen[key]
        return index, np.array(kinds, dtype=float)

"""What the projection method takes for granted, checked on the touches."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.base_calibration.stage import Readings, Stage
from robocal.base_calibration.start import align
from robocal.base_calibration.touches import Touches
from robocal.base_calibration.triangles import wrapped
from robocal.frames import xyz_ypr_from_frame

_TOLERANCE = 1e-3
"""An angle that is off by this puts a touch one metre away 1 mm off [rad]"""
_SAME = 1e-3
"""Slide positions within this are one position; larger than any reading noise [m]"""


@dataclass(frozen=True)
class Assumption:
    """One assumption, and what the touches say of it."""

    name: str
    holds: bool
    finding: str
    """One clause with the figure that was found."""


@dataclass(frozen=True)
class Polyhedron:
    """The paper's four touches: P1, P2 by the master, R1, R2 by the slave."""

    master: Float[Array, "2 3"]
    """P1, P2 in the master's base [m]."""
    slave: Float[Array, "2 3"]
    """R1, R2 in the slave's base [m]."""
    master_polar: tuple[float, float]
    """Yaw of the needle at P1, P2, which the method takes for the polar angle [rad]."""
    slave_polar: tuple[float, float]
    travel: float
    """E, from P2 on along the guide [m]."""
    angles: Float[Array, "2"]
    """Rod angle at R1, R2 [rad]."""
    lengths: Float[Array, "2"]
    """Rod length at R1, R2 [m]."""

    @property
    def guide(self) -> Float[Array, "3"]:
        """Direction from P1 to P2."""
        line = self.master[1] - self.master[0]
        return np.asarray(line / np.linalg.norm(line))

    @property
    def climb(self) -> float:
        """How steeply the guide rises, eq. (7) [rad]."""
        return float(np.arcsin(self.guide[2]))

    def rods_from_above(self) -> tuple[Float[Array, "2"], Float[Array, "2"]]:
        """Length [m] and angle [rad] of the rod in the X-Y view, eq. (8)-(10)."""
        across = self.lengths * np.sin(self.angles)
        along = self.lengths * np.cos(self.angles) * np.cos(self.climb)
        return np.hypot(across, along), np.arctan2(across, along)


def check_assumptions(
    touches: Touches, stage: Stage
) -> tuple[Polyhedron | None, tuple[Assumption, ...]]:
    """The four touches that the method uses, and whether they are what it needs."""
    chosen = _choose(touches)
    if chosen is None:
        return None, (
            Assumption(
                "touches_of_the_method",
                holds=False,
                finding="it needs the master on the rod cup at rod angle zero and on the slide cup "
                "with the slide at rest, and the slave twice on the rod cup at one slide position",
            ),
        )
    figure = _polyhedron(touches, *chosen)
    return figure, (_polar_angles(figure), _level(touches, stage, chosen[0]))


def _choose(touches: Touches) -> tuple[tuple[int, int], tuple[int, int]] | None:
    """Indices of P1, P2 and R1, R2, in order of the touches."""
    slide = touches.readings.slide
    master_rod = ~touches.by_slave & touches.on_rod & (np.abs(touches.readings.angle) < _TOLERANCE)
    for p1 in np.flatnonzero(master_rod):
        here = touches.placement == touches.placement[p1]
        rest = here & (np.abs(slide - slide[p1]) < _SAME)
        p2 = _first(rest & ~touches.by_slave & ~touches.on_rod)
        for r1 in np.flatnonzero(here & touches.by_slave & touches.on_rod):
            apart = np.abs(touches.readings.angle - touches.readings.angle[r1]) > _TOLERANCE
            still = here & (np.abs(slide - slide[r1]) < _SAME)
            r2 = _first(still & apart & touches.by_slave & touches.on_rod)
            if p2 is not None and r2 is not None:
                return (int(p1), p2), (int(r1), r2)
    return None


def _first(which: Bool[Array, "touch"]) -> int | None:
    found = np.flatnonzero(which)
    return int(found[0]) if len(found) else None


def _polyhedron(touches: Touches, p: tuple[int, int], r: tuple[int, int]) -> Polyhedron:
    def yaws(pair: tuple[int, int]) -> tuple[float, float]:
        first, second = (float(xyz_ypr_from_frame(touches.needle_poses[k])[3]) for k in pair)
        return first, second

    readings = touches.readings
    return Polyhedron(
        master=touches.tips[list(p)],
        slave=touches.tips[list(r)],
        master_polar=yaws(p),
        slave_polar=yaws(r),
        travel=float(readings.slide[list(r)].mean() - readings.slide[p[1]]),
        angles=readings.angle[list(r)],
        lengths=readings.length[list(r)],
    )


def _polar_angles(figure: Polyhedron) -> Assumption:
    """The needle's yaw must be the polar angle of its tip: joint 1 alone moved, tool aligned."""
    points = np.concatenate([figure.master, figure.slave])
    yaws = (*figure.master_polar, *figure.slave_polar)
    off = [
        abs(wrapped(yaw - float(np.arctan2(point[1], point[0]))))
        for yaw, point in zip(yaws, points, strict=True)
    ]
    worst = int(np.argmax(off))
    name = ("P1", "P2", "R1", "R2")[worst]
    return Assumption(
        "needle_yaw_is_polar_angle",
        holds=off[worst] <= _TOLERANCE,
        finding=f"the needle's yaw at {name} is {off[worst] * 1e3:.2f} mrad off the polar angle of "
        f"its tip (allowed {_TOLERANCE * 1e3:g}; only joint 1 may move, with the tool aligned)",
    )


def _level(touches: Touches, stage: Stage, p: tuple[int, int]) -> Assumption:
    """The rod must turn in the plane of the guide and the horizontal across it."""
    here = (touches.placement == touches.placement[p[0]]) & ~touches.by_slave
    cups = _sensor_points(touches.readings, touches.on_rod)[here]
    values = np.linalg.svd(cups - cups.mean(axis=0), compute_uv=False)
    sure = np.sqrt(np.diag(touches.tip_covariance).mean()) / max(values[1], 1e-9)
    if sure < 0.25 * _TOLERANCE:
        frame = align(cups, touches.tips[here], np.array([0.0, 0.0, 1.0]))
        tilt = abs(float(np.arcsin(frame[2, 1])))
        return Assumption(
            "rod_plane_is_level_across",
            holds=tilt <= _TOLERANCE,
            finding=f"the rod's plane leans {tilt * 1e3:.2f} mrad across the guide in the master's "
            f"base (allowed {_TOLERANCE * 1e3:g})",
        )
    said = "is stated" if stage.level_in_master else "is neither stated (level_in_master)"
    return Assumption(
        "rod_plane_is_level_across",
        holds=stage.level_in_master,
        finding=f"that the rod's plane is level across the guide {said}"
        + ("" if stage.level_in_master else " nor shown by the master's touches"),
    )


def _sensor_points(readings: Readings, on_rod: Bool[Array, "touch"]) -> Float[Array, "touch 3"]:
    """Cups in the stage frame, sensors taken at their word [m]."""
    reach = np.where(on_rod, readings.length, 0.0)
    x = readings.slide - reach * np.cos(readings.angle)
    return np.column_stack([x, reach * np.sin(readings.angle), np.zeros(len(x))])

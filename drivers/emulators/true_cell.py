"""The true cell: what the robot and the target really are, behind what the devices report.

Nothing here knows how devices talk. Joint readings are what the controller believes; the target
is where the true geometry, the hidden effects and the arm's scatter put it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drivers.emulators import motion
from drivers.emulators.clock import WorldClock
from drivers.emulators.drawing import disturbed_links, draw_base, draw_tool
from drivers.emulators.effect import Effect
from drivers.emulators.effects import read_effect
from drivers.emulators.hidden_cell import HiddenCell
from drivers.emulators.records import WorldError
from drivers.emulators.rigid import Frame, Matrix, quaternion, small_turn
from drivers.emulators.robot_file import NominalRobot, read_masses, read_robot
from drivers.emulators.stance import Circumstances, Load
from drivers.emulators.true_arm import STANDARD_GRAVITY, Vector
from drivers.emulators.world_config import WorldConfig

SAFETY_WORDS = (
    "normal",
    "reduced",
    "protective_stop",
    "emergency_stop",
    "safeguard_stop",
    "fault",
    "not_ready",
)
MAY_MOVE = ("normal", "reduced")
SAFETY_STOP_DECELERATION = 10.0
"""How hard the leading joint brakes when the safety state forbids motion [rad/s2]."""


@dataclass(frozen=True)
class TargetReading:
    """One reading of the target in the tracker's frame."""

    position: tuple[float, float, float]
    """[m]"""
    orientation: tuple[float, float, float, float]
    """Unit quaternion w, x, y, z."""
    time_s: float


class TrueCell:
    """One robot with its target in front of one tracker."""

    def __init__(self, config: WorldConfig) -> None:
        geometry, frames, noise, scatter = np.random.SeedSequence(config.seed).spawn(4)
        self.config = config
        self.clock = WorldClock(config.time_scale)
        self.nominal = read_robot(Path(config.robot))
        self.table = disturbed_links(
            self.nominal.table, config.geometry_error, np.random.default_rng(geometry)
        )
        draw = np.random.default_rng(frames)
        drawn_base, drawn_tool = draw_base(draw), draw_tool(draw)
        self.base = config.base or drawn_base
        self.tool = config.tool or drawn_tool
        self.load = _load(config, self.nominal, self.tool)
        self.effects = self._read_effects(config.effects)
        self.safety = "normal"
        self.beam_blocked = False
        self.payload_kg = config.payload_kg
        self.fixed_temperature_degc: float | None = None
        self.stage = dict(config.stage)
        self.guardian: int | None = None
        self._noise = np.random.default_rng(noise)
        self._scatter = np.random.default_rng(scatter)
        self._arrival_error = np.zeros(self.table.n_joints)
        self._last_motion = (0,) * self.table.n_joints
        self._last_speed = 0.0
        self._readings = 0
        self._segment = motion.at_rest(_start(config, self.nominal), self.clock.now())
        self._stops = [self._segment.target]

    def joints(self, time_s: float) -> tuple[float, ...]:
        """Joint readings of the controller at a world time since the last motion began."""
        return self._segment.joints(time_s)

    def moving(self, time_s: float) -> bool:
        """Whether the robot moves at that time."""
        return self._segment.moving(time_s)

    def move(self, target: tuple[float, ...], speed: float, acceleration: float) -> motion.Segment:
        """Start a motion from rest; refuse what a controller would refuse."""
        if self.safety not in MAY_MOVE:
            raise WorldError("unsafe", f"The safety state is {self.safety}: no motion.")
        now = self.clock.now()
        if self.moving(now):
            raise WorldError("moving", "The robot moves already: stop it or wait.")
        self._check_target(target, speed, acceleration)
        here = self.joints(now)
        self._segment = motion.move(here, target, now, speed, acceleration)
        self._last_speed = speed
        self._stops.append(target)
        self._last_motion = tuple(
            int(np.sign(b - a)) or before
            for a, b, before in zip(here, target, self._last_motion, strict=True)
        )
        self._arrival_error = self._draw_scatter()
        return self._segment

    def guide(self, target: tuple[float, ...]) -> None:
        """Stand at these joints at once: a person has led the robot there by hand."""
        now = self.clock.now()
        if self.moving(now):
            raise WorldError("moving", "The robot moves on a command: it cannot be led by hand.")
        self._check_target(target, 1.0, 1.0)
        self._segment = motion.at_rest(target, now)
        self._stops.append(target)

    def _draw_scatter(self) -> Vector:
        """By how much the joints miss their place this time [rad], [m] for a prismatic joint."""
        scatter = self._scatter.normal(
            0.0, self.config.repeatability_mm * 1e-3, self.table.n_joints
        )
        # An arm of no length has no point that a turn would move.
        reach = self.table.reach() or np.inf
        return np.where(self.table.prismatic, scatter, scatter / reach)

    def _check_target(self, target: tuple[float, ...], speed: float, acceleration: float) -> None:
        if len(target) != self.table.n_joints:
            raise WorldError("bad_request", f"{self.table.n_joints} joints are needed.")
        if not all(map(math.isfinite, target)) or not (speed > 0.0 and acceleration > 0.0):
            raise WorldError("bad_request", "Joints, speed and acceleration must be finite, > 0.")
        for number, (q, (low, high)) in enumerate(
            zip(target, self.nominal.limits, strict=True), start=1
        ):
            if not low <= q <= high:
                raise WorldError(
                    "limits", f"Joint {number}: {q:.6g} is not within {low:.6g} to {high:.6g}."
                )

    def stop(self, deceleration: float) -> motion.Segment:
        """Bring the robot to rest along its path; harmless at rest."""
        if not deceleration > 0.0:
            raise WorldError("bad_request", "The deceleration must be > 0.")
        self._segment = motion.stop(self._segment, self.clock.now(), deceleration)
        self._stops[-1] = self._segment.target
        return self._segment

    def abandon(self, client: int) -> None:
        """Stop the robot if this client started it and wanted it stopped when it goes away."""
        if client == self.guardian:
            self.stop(SAFETY_STOP_DECELERATION)

    def set_safety(self, word: str) -> None:
        """Change the safety state; one that forbids motion brakes the robot."""
        if word not in SAFETY_WORDS:
            raise WorldError("bad_request", f"safety must be one of {', '.join(SAFETY_WORDS)}.")
        self.safety = word
        if word not in MAY_MOVE:
            self.stop(SAFETY_STOP_DECELERATION)

    def set_effects(self, entries: tuple[Mapping[str, Any], ...]) -> None:
        """Put these hidden effects in place of all present ones."""
        self.effects = self._read_effects(entries)

    def add_effect(self, entries: Mapping[str, Any]) -> None:
        """Put one more hidden effect beside the present ones."""
        self.effects = (*self.effects, *self._read_effects((entries,)))

    def temperature_degc(self) -> float:
        """Temperature of the arm now, on its warm-up curve unless it was set."""
        if self.fixed_temperature_degc is not None:
            return self.fixed_temperature_degc
        return self.config.temperature.at(self.clock.now())

    def measure(self, nest: str | None = None) -> TargetReading:
        """Read the robot's target, or the one in a fixed nest, with the instrument's noise."""
        if self.beam_blocked:
            raise WorldError("no_target", "The beam is blocked.")
        now = self.clock.now()
        q = np.array(self._segment.joints(now))
        T = self.target_pose(q, now) if nest is None else self._nest_pose(nest, q, now)
        self._readings += 1
        noise = self.config.noise
        growing = noise.ppm * 1e-6 * float(np.linalg.norm(T[:3, 3]))
        sigma = math.hypot(noise.position_mm * 1e-3, growing)
        position = self.hidden().seen(T) + self._noise.normal(0.0, sigma, 3)
        turn = small_turn(self._noise.normal(0.0, noise.orientation_mrad * 1e-3, 3))
        x, y, z = (float(v) for v in position)
        return TargetReading((x, y, z), quaternion(turn @ T[:3, :3]), now)

    def _nest_pose(self, nest: str, q: Vector, time_s: float) -> Matrix:
        """Where a nest on the robot's floor is now: like the base, as the tracker sees it."""
        if nest not in self.config.nests:
            raise WorldError("no_nest", f"No nest {nest!r}, there are {list(self.config.nests)}.")
        T = np.eye(4)
        T[:3, 3] = np.array(self.config.nests[nest]) * 1e-3
        base = self.base.matrix()
        now = self.hidden().base_now(q, self.circumstances(time_s))
        return np.asarray(now @ np.linalg.inv(base) @ T)

    def hidden(self) -> HiddenCell:
        """Return the cell as the effects of this moment make it."""
        return HiddenCell(
            self.table, self.base.matrix(), self.tool.matrix(), self.load, self.effects
        )

    def true_joints(self, q: Vector, now: Circumstances) -> Vector:
        """Joint positions that the arm really has at these readings."""
        return self.hidden().true_joints(q, now) + self._arrival_error

    def target_pose(self, q: Vector, time_s: float) -> Matrix:
        """Where the target truly is in the tracker's frame at these joint readings."""
        return self.hidden().target_pose(q, self.circumstances(time_s), self._arrival_error)

    def circumstances(self, time_s: float) -> Circumstances:
        """Everything that effects may depend on, at a world time."""
        segment = self._segment
        return Circumstances(
            time_s=np.array(time_s),
            temperature_degc=np.array(self.temperature_degc()),
            payload_kg=np.array(self.payload_kg),
            readings=np.array(self._readings, dtype=float),
            last_motion=np.array(self._last_motion, dtype=float),
            last_move=np.array(segment.target) - np.array(segment.start),
            speed=np.array(self._last_speed),
            settled_s=np.array(max(time_s - segment.start_s - segment.duration_s, 0.0)),
            stops=np.array(self._stops),
            stop=np.array(len(self._stops) - 1),
        )

    def _read_effects(self, entries: tuple[Mapping[str, Any], ...]) -> tuple[Effect, ...]:
        return tuple(read_effect(entry, self.table.n_joints) for entry in entries)


def _load(config: WorldConfig, robot: NominalRobot, tool: Frame) -> Load:
    masses = read_masses(config.links) if config.links else robot.masses
    n = robot.table.n_joints
    if masses and len(masses) != n:
        raise WorldError("config", f"{len(masses)} links are given, the robot has {n}.")
    x, y, z = (v * 1e-3 for v in tool.xyz_mm)
    gx, gy, gz = np.array(config.gravity) / np.linalg.norm(config.gravity) * STANDARD_GRAVITY
    return Load(tuple(enumerate(masses, start=1)), n, (x, y, z), (gx, gy, gz))


def _start(config: WorldConfig, robot: NominalRobot) -> tuple[float, ...]:
    if config.start_joints_deg is None:
        return tuple(
            0.0 if low <= 0.0 <= high else 0.5 * (low + high) for low, high in robot.limits
        )
    units = (1e-3 if p else math.pi / 180 for p in robot.table.prismatic)
    return tuple(v * u for v, u in zip(config.start_joints_deg, units, strict=True))

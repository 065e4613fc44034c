"""The world's configuration file."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from drivers.emulators.records import build
from drivers.emulators.rigid import Frame


@dataclass(frozen=True)
class GeometryError:
    """Standard deviations of the true geometry about the nominal one."""

    length_mm: float = 0.5
    angle_mrad: float = 1.0


@dataclass(frozen=True)
class InstrumentNoise:
    """Standard deviations of one reading, per axis.

    Of a position: the root of the squares of `position_mm` and of `ppm` of the range.
    """

    position_mm: float = 0.015
    ppm: float = 6.0
    orientation_mrad: float = 0.05


@dataclass(frozen=True)
class WarmUp:
    """Temperature of the arm: from `start_degc` to `final_degc` as 1 - exp(-t / time constant)."""

    start_degc: float = 20.0
    final_degc: float = 20.0
    time_constant_s: float = 1800.0

    def at(self, time_s: float) -> float:
        """Temperature at a world time [degC]."""
        gone = math.exp(-time_s / self.time_constant_s)
        return self.final_degc + (self.start_degc - self.final_degc) * gone


@dataclass(frozen=True)
class WorldConfig:
    """Everything that a configuration file may say; `robot` alone is required."""

    robot: str
    """Path of robot.yaml, seen from the configuration file."""
    seed: int = 1
    time_scale: float = 1.0
    geometry_error: GeometryError = GeometryError()
    base: Frame | None = None
    """Base in the tracker's frame; None draws it from the seed."""
    tool: Frame | None = None
    """Target in the flange frame; None draws it from the seed."""
    noise: InstrumentNoise = InstrumentNoise()
    repeatability_mm: float = 0.01
    """Standard deviation of the tool at full reach from one joint's scatter between arrivals."""
    temperature: WarmUp = WarmUp()
    payload_kg: float = 0.0
    gravity: tuple[float, float, float] = (0.0, 0.0, -1.0)
    """Direction in the robot base frame."""
    effects: tuple[Mapping[str, Any], ...] = ()
    links: tuple[Mapping[str, Any], ...] = ()
    """Masses in place of those in robot.yaml."""
    start_joints_deg: tuple[float, ...] | None = None
    """[deg], [mm] for a prismatic joint; None starts at 0 or, outside the limits, in their middle.
    """
    nests: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    """Reference nests beside the robot by name, at world time 0 in the tracker's frame [mm]."""
    stage: Mapping[str, float] = field(default_factory=dict)
    """Values of the stage sensors by name [m], [rad]."""


def read_config(path: Path) -> WorldConfig:
    """Read a configuration file; a field that it does not know is an error."""
    entries = json.loads(path.read_text())
    sections: dict[str, type] = {
        "geometry_error": GeometryError,
        "base": Frame,
        "tool": Frame,
        "noise": InstrumentNoise,
        "temperature": WarmUp,
    }
    for name, section in sections.items():
        if name in entries:
            entries[name] = build(section, entries[name], f"{path.name}: {name}")
    config = build(WorldConfig, entries, path.name)
    return replace(config, robot=str(path.parent / config.robot))

"""Hidden effects on links, base and tool."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivers.emulators.effect import Circumstances, Effect
from drivers.emulators.rigid import Matrix, small_turn, translation
from drivers.emulators.true_arm import LinkTable


@dataclass(frozen=True)
class ThermalExpansion(Effect):
    """Links grow with temperature: length = length at reference x (1 + cte x difference)."""

    cte_ppm_per_k: float = 23.0
    """Default: aluminium [1e-6/K]."""
    reference_degc: float = 20.0

    def links(self, table: LinkTable, now: Circumstances) -> LinkTable:
        """Return the table with `a` and `d` grown."""
        growth = 1.0 + self.cte_ppm_per_k * 1e-6 * (now.temperature_degc - self.reference_degc)
        return replace(table, a=table.a * growth, d=table.d * growth)


@dataclass(frozen=True)
class BaseDrift(Effect):
    """The base moves steadily in the tracker's frame from world time 0."""

    rate_mm_per_h: tuple[float, float, float]
    turn_mrad_per_h: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def base(self, T_tracker_base: Matrix, now: Circumstances) -> Matrix:
        """Return the base shifted, and turned about its own origin, in proportion to time."""
        hours = now.time_s / 3600.0
        drifted = T_tracker_base.copy()
        drifted[:3, :3] = (
            small_turn(np.array(self.turn_mrad_per_h) * 1e-3 * hours) @ T_tracker_base[:3, :3]
        )
        drifted[:3, 3] += np.array(self.rate_mm_per_h) * 1e-3 * hours
        return drifted


@dataclass(frozen=True)
class ToolStep(Effect):
    """The target slips on the flange, at a world time or after a number of readings."""

    step_mm: tuple[float, float, float]
    """In the flange frame."""
    at_s: float = float("inf")
    after_readings: float = float("inf")

    def tool(self, T_flange_target: Matrix, now: Circumstances) -> Matrix:
        """Return the tool, shifted once the moment has come."""
        if now.time_s < self.at_s and now.readings < self.after_readings:
            return T_flange_target
        x, y, z = (v * 1e-3 for v in self.step_mm)
        return translation(x, y, z) @ T_flange_target

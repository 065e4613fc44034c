"""Hidden effects on links, base and tool that come with temperature, time and bumps."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from drivers.emulators.effect import Effect
from drivers.emulators.moment import has_come
from drivers.emulators.rigid import Matrix, small_turn, translation
from drivers.emulators.stance import Circumstances, Stance
from drivers.emulators.true_arm import LinkTable, Vector


def grown(table: LinkTable, growth: Vector, link_shares: tuple[float, ...]) -> LinkTable:
    """Return the links with `a` and `d` grown, each by its own share of the growth."""
    shares = np.array(link_shares or (1.0,) * table.n_joints)
    factor = 1.0 + np.asarray(growth)[..., None] * shares
    return replace(table, a=table.a * factor, d=table.d * factor)


@dataclass(frozen=True)
class ThermalExpansion(Effect):
    """Links grow with temperature: length = length at reference x (1 + cte x difference)."""

    cte_ppm_per_k: float = 23.0
    """Default: aluminium [1e-6/K]."""
    reference_degc: float = 20.0
    link_shares: tuple[float, ...] = ()
    """Expansion of every link over `cte_ppm_per_k`; empty: all alike."""

    def links(self, table: LinkTable, now: Circumstances) -> LinkTable:
        """Return the table with `a` and `d` grown."""
        warmer = now.temperature_degc - self.reference_degc
        return grown(table, np.asarray(self.cte_ppm_per_k * 1e-6 * warmer), self.link_shares)


@dataclass(frozen=True)
class WarmUp(Effect):
    """Links grow with time, whatever a sensor says: growth x (1 - exp(-t / time constant))."""

    growth_ppm: float
    time_constant_s: float
    link_shares: tuple[float, ...] = ()

    def links(self, table: LinkTable, now: Circumstances) -> LinkTable:
        """Return the table with `a` and `d` grown."""
        rise = -np.expm1(-now.time_s / self.time_constant_s)
        return grown(table, np.asarray(self.growth_ppm * 1e-6 * rise), self.link_shares)


@dataclass(frozen=True)
class BaseDrift(Effect):
    """The base moves in the tracker's frame from world time 0, steadily or ever more slowly."""

    rate_mm_per_h: tuple[float, float, float]
    turn_mrad_per_h: tuple[float, float, float] = (0.0, 0.0, 0.0)
    time_constant_s: float = math.inf
    """The rate falls as exp(-t / time constant)."""

    def base(self, T_tracker_base: Matrix, stance: Stance) -> Matrix:
        """Return the base shifted, and turned about its own origin."""
        hours = np.asarray(stance.now.time_s) / 3600.0
        if math.isfinite(self.time_constant_s):
            slow = self.time_constant_s / 3600.0
            hours = -slow * np.expm1(-hours / slow)
        shape = (*hours.shape, 4, 4)
        drifted = np.array(np.broadcast_to(T_tracker_base, shape), copy=True)
        turn = small_turn(np.array(self.turn_mrad_per_h) * 1e-3 * hours[..., None])
        drifted[..., :3, :3] = turn @ drifted[..., :3, :3]
        drifted[..., :3, 3] += np.array(self.rate_mm_per_h) * 1e-3 * hours[..., None]
        return drifted


@dataclass(frozen=True)
class BaseStep(Effect):
    """Robot or station is bumped, at a world time or after a number of readings."""

    step_mm: tuple[float, float, float]
    """In the tracker's frame."""
    turn_mrad: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """About the tracker's axes, through the base's origin."""
    at_s: float = math.inf
    after_readings: float = math.inf
    creep_s: float = 0.0

    def base(self, T_tracker_base: Matrix, stance: Stance) -> Matrix:
        """Return the base, moved once the moment has come."""
        share = has_come(stance.now, self.at_s, self.after_readings, self.creep_s)[..., None]
        moved = np.array(np.broadcast_to(T_tracker_base, (*share.shape[:-1], 4, 4)), copy=True)
        moved[..., :3, :3] = (
            small_turn(np.array(self.turn_mrad) * 1e-3 * share) @ moved[..., :3, :3]
        )
        moved[..., :3, 3] += np.array(self.step_mm) * 1e-3 * share
        return moved


@dataclass(frozen=True)
class ToolStep(Effect):
    """The target slips on the flange, at a world time or after a number of readings."""

    step_mm: tuple[float, float, float]
    """In the flange frame."""
    at_s: float = math.inf
    after_readings: float = math.inf
    creep_s: float = 0.0

    def tool(self, T_flange_target: Matrix, stance: Stance) -> Matrix:
        """Return the tool, shifted once the moment has come."""
        share = has_come(stance.now, self.at_s, self.after_readings, self.creep_s)
        x, y, z = (v * 1e-3 * share for v in self.step_mm)
        return np.asarray(translation(x, y, z) @ T_flange_target)

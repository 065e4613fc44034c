"""The hidden effects that the world knows, by the names of the public interface."""

from collections.abc import Mapping
from typing import Any

from drivers.emulators.cell_effects import BaseDrift, ThermalExpansion, ToolStep
from drivers.emulators.effect import Effect, JointEffect
from drivers.emulators.joint_effects import Backlash, GearHarmonic, JointCompliance
from drivers.emulators.records import WorldError, build

EFFECTS: dict[str, type[Effect]] = {
    "joint_compliance": JointCompliance,
    "gear_harmonic": GearHarmonic,
    "backlash": Backlash,
    "thermal_expansion": ThermalExpansion,
    "base_drift": BaseDrift,
    "tool_step": ToolStep,
}


def read_effect(entries: Mapping[str, Any], n_joints: int) -> Effect:
    """Make an effect of its JSON form, `effect` being its name."""
    name = entries.get("effect")
    if name not in EFFECTS:
        raise WorldError("config", f"effect {name!r} is unknown, known: {sorted(EFFECTS)}.")
    arguments = {k: v for k, v in entries.items() if k != "effect"}
    effect = build(EFFECTS[name], arguments, f"effect {name}")
    if isinstance(effect, JointEffect) and not 1 <= effect.joint <= n_joints:
        raise WorldError("config", f"effect {name}: joint {effect.joint} is not 1 to {n_joints}.")
    return effect

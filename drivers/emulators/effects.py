"""The hidden effects that the world knows."""

from collections.abc import Mapping
from typing import Any

from drivers.emulators.cell_effects import BaseDrift, BaseStep, ThermalExpansion, ToolStep, WarmUp
from drivers.emulators.effect import Effect, JointEffect
from drivers.emulators.instrument_effects import InstrumentAngle, InstrumentScale
from drivers.emulators.joint_effects import (
    Backlash,
    EncoderGain,
    EncoderStep,
    GearHarmonic,
    JointCoupling,
    JointThermalDrift,
    Settling,
)
from drivers.emulators.load_effects import (
    BaseCompliance,
    JointCompliance,
    LinkBending,
    LoadBacklash,
    PayloadCompliance,
)
from drivers.emulators.records import WorldError, build
from drivers.emulators.unlisted_effects import (
    AxisWobble,
    BearingCompliance,
    FourBar,
    GripperSag,
    Hysteresis,
    StationSway,
    StiffeningCompliance,
    SubdivisionError,
    TargetAcceptance,
    ToolHeat,
)

LISTED: dict[str, type[Effect]] = {
    "joint_compliance": JointCompliance,
    "payload_compliance": PayloadCompliance,
    "link_bending": LinkBending,
    "base_compliance": BaseCompliance,
    "gear_harmonic": GearHarmonic,
    "encoder_gain": EncoderGain,
    "joint_coupling": JointCoupling,
    "backlash": Backlash,
    "load_backlash": LoadBacklash,
    "settling": Settling,
    "thermal_expansion": ThermalExpansion,
    "joint_thermal_drift": JointThermalDrift,
    "warm_up": WarmUp,
    "base_drift": BaseDrift,
    "base_step": BaseStep,
    "tool_step": ToolStep,
    "encoder_step": EncoderStep,
    "instrument_scale": InstrumentScale,
    "instrument_angle": InstrumentAngle,
}
"""By the names of the public interface."""

UNLISTED: dict[str, type[Effect]] = {
    "hysteresis": Hysteresis,
    "axis_wobble": AxisWobble,
    "stiffening_compliance": StiffeningCompliance,
    "bearing_compliance": BearingCompliance,
    "subdivision_error": SubdivisionError,
    "four_bar": FourBar,
    "station_sway": StationSway,
    "gripper_sag": GripperSag,
    "tool_heat": ToolHeat,
    "target_acceptance": TargetAcceptance,
}
"""Causes that the public interface has no name for."""

EFFECTS: dict[str, type[Effect]] = {**LISTED, **UNLISTED}


def read_effect(entries: Mapping[str, Any], n_joints: int) -> Effect:
    """Make an effect of its JSON form, `effect` being its name."""
    name = entries.get("effect")
    if name not in EFFECTS:
        raise WorldError("config", f"effect {name!r} is unknown, known: {sorted(EFFECTS)}.")
    arguments = {k: v for k, v in entries.items() if k != "effect"}
    effect = build(EFFECTS[name], arguments, f"effect {name}")
    if isinstance(effect, JointEffect):
        _check_joint(name, "joint", effect.joint, n_joints)
    if isinstance(effect, (JointCoupling, FourBar)):
        _check_joint(name, "driven_by", effect.driven_by, n_joints)
    return effect


def _check_joint(name: str, field: str, joint: int, n_joints: int) -> None:
    if not 1 <= joint <= n_joints:
        raise WorldError("config", f"effect {name}: {field} {joint} is not 1 to {n_joints}.")

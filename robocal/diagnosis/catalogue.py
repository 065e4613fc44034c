"""The effects by name."""

from robocal.diagnosis.effect import Effect
from robocal.diagnosis.effects.backlash import Backlash
from robocal.diagnosis.effects.base_compliance import BaseCompliance
from robocal.diagnosis.effects.base_drift import BaseDrift
from robocal.diagnosis.effects.base_step import BaseStep
from robocal.diagnosis.effects.encoder_gain import EncoderGain
from robocal.diagnosis.effects.encoder_step import EncoderStep
from robocal.diagnosis.effects.gear_harmonic import GearHarmonic
from robocal.diagnosis.effects.instrument_angle import InstrumentAngle
from robocal.diagnosis.effects.instrument_scale import InstrumentScale
from robocal.diagnosis.effects.joint_compliance import JointCompliance
from robocal.diagnosis.effects.joint_coupling import JointCoupling
from robocal.diagnosis.effects.joint_thermal_drift import JointThermalDrift
from robocal.diagnosis.effects.link_bending import LinkBending
from robocal.diagnosis.effects.load_backlash import LoadBacklash
from robocal.diagnosis.effects.payload_compliance import PayloadCompliance
from robocal.diagnosis.effects.settling import Settling
from robocal.diagnosis.effects.thermal_expansion import ThermalExpansion
from robocal.diagnosis.effects.tool_step import ToolStep
from robocal.diagnosis.effects.warm_up import WarmUp

_ALL: tuple[Effect, ...] = (
    JointCompliance(),
    PayloadCompliance(),
    LinkBending(),
    BaseCompliance(),
    GearHarmonic(),
    EncoderGain(),
    JointCoupling(),
    Backlash(),
    LoadBacklash(),
    Settling(),
    ThermalExpansion(),
    JointThermalDrift(),
    WarmUp(),
    BaseDrift(),
    BaseStep(),
    ToolStep(),
    EncoderStep(),
    InstrumentScale(),
    InstrumentAngle(),
)
EFFECTS: dict[str, Effect] = {effect.name: effect for effect in _ALL}

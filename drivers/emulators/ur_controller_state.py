"""What the controller's three servers share: the arm, the program slot, switches, faults."""

from dataclasses import dataclass, field

from .ur_arm import Arm, ArmState
from .ur_safety import (
    MODE_IDLE,
    MODE_POWER_OFF,
    MODE_RUNNING,
    POWER_ON,
    PROGRAM_RUNNING,
    SAFETY,
)
from .ur_script import ControlProgram
from .ur_wire import Value, register_index

RUNTIME_STOPPED, RUNTIME_PLAYING = 1, 2


@dataclass
class Faults:
    """Switches that make the controller misbehave on purpose."""

    silent: bool = False
    """Connections stay open and new ones are accepted, but nothing is heard nor said."""
    frozen: bool = False
    """Data packages keep coming with old values and an old timestamp."""


@dataclass
class Controller:
    """The controller without its wires."""

    arm: Arm
    program: ControlProgram
    faults: Faults = field(default_factory=Faults)
    remote_control: bool = True
    drives_on: bool = False
    """Power is on although the brakes are closed; only looked at while the world is not ready."""
    shown: ArmState = field(init=False)
    """The arm as data packages show it."""

    def __post_init__(self) -> None:
        self.shown = self.arm.state

    async def cycle(self, now_s: float) -> None:
        """Look at the arm and run the program once; `now_s` is real time."""
        state = await self.arm.look()
        await self.program.step(now_s)
        if not self.faults.frozen:
            self.shown = state

    @property
    def robot_mode(self) -> int:
        """RTDE's ``robot_mode``."""
        if self.arm.state.safety != "not_ready":
            return MODE_RUNNING
        return MODE_IDLE if self.drives_on else MODE_POWER_OFF

    def output(self, name: str) -> Value:
        """Value of an output field."""
        if name.startswith("output_int_register_"):
            return self.program.registers.output_int[register_index(name)]
        if name.startswith("output_double_register_"):
            return self.program.registers.output_double[register_index(name)]
        return self._status(name)

    def _status(self, name: str) -> Value:
        state = self.shown
        safety = SAFETY[state.safety]
        power = POWER_ON if self.robot_mode != MODE_POWER_OFF else 0
        values: dict[str, Value] = {
            "timestamp": state.time_s,
            "actual_q": state.joints,
            "actual_qd": state.velocity,
            "target_q": state.joints,
            "target_qd": state.velocity,
            "robot_mode": self.robot_mode,
            "safety_mode": safety.mode,
            "robot_status_bits": power | (PROGRAM_RUNNING if self.program.running else 0),
            "safety_status_bits": safety.bits,
            "runtime_state": RUNTIME_PLAYING if self.program.running else RUNTIME_STOPPED,
        }
        return values[name]

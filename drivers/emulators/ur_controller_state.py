"""What the controller's three servers share: the arm, the program slot, switches, faults."""

from dataclasses import dataclass, field

from .ur_arm import Arm
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
    _shown: dict[str, Value] = field(init=False)
    """Status fields as data packages show them."""

    def __post_init__(self) -> None:
        self._shown = self._status()

    async def cycle(self, now_s: float) -> None:
        """Look at the arm and run the program once; `now_s` is real time."""
        await self.arm.look()
        await self.program.step(now_s)
        if not self.faults.frozen:
            self._shown = self._status()

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
        return self._shown[name]

    def _status(self) -> dict[str, Value]:
        state = self.arm.state
        safety = SAFETY[state.safety]
        power = POWER_ON if self.robot_mode != MODE_POWER_OFF else 0
        return {
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

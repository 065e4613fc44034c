"""The control program that `ur_rtde` uploads, as the controller runs it.

The program is a loop over registers: a non-zero command in ``input_int_register_0`` is executed
once, ``output_int_register_0`` then says 2 (done), and 1 (ready) again after the command register
went back to 0. Numbers and register use are those of ``rtde_control.script`` of ur_rtde 1.6.5.

The watchdog and the delay of a program start run in real time, not on the world's clock: they are
between two computers, and a sped-up world must not ask a client for kicks every few milliseconds.
"""

import sys
from dataclasses import dataclass, field

from .ur_arm import N_JOINTS, Arm, WorldRefusedError
from .ur_wire import N_REGISTERS

READY, DONE = 1, 2

MOVE_J = 1
STOP_L = 33
STOP_J = 34
SET_WATCHDOG = 35
IS_STEADY = 47
KICK_WATCHDOG = 99
STOP_SCRIPT = 255

PROGRAM_START_S = 0.05
"""Real time between the end of the upload and the first line of the program [s]."""
LONGEST_CYCLE_S = 0.02
"""A controller never stands still; when this process did, the watchdog counts no more than this."""
PROGRAM_STOP_DECELERATION = 4.0
"""[rad/s2] A controller brakes the arm when its program ends in the middle of a motion."""


@dataclass
class Registers:
    """General purpose registers, as RTDE and the program see them."""

    input_int: list[int] = field(default_factory=lambda: [0] * N_REGISTERS)
    input_double: list[float] = field(default_factory=lambda: [0.0] * N_REGISTERS)
    output_int: list[int] = field(default_factory=lambda: [0] * N_REGISTERS)
    output_double: list[float] = field(default_factory=lambda: [0.0] * N_REGISTERS)
    command_written_s: float = 0.0
    """Real time at which ``input_int_register_0`` was last written, even with the same value."""


@dataclass
class AsyncProgress:
    """Content of ``output_int_register_2``, which tells how the last asynchronous move goes."""

    operation: int = 0
    writes: int = 0
    running: bool = False

    def begin(self) -> int:
        """Start the next operation."""
        self.operation = (self.operation + 1) % 128
        return self._write(running=True)

    def finish(self) -> int:
        """End the present operation."""
        return self._write(running=False)

    def _write(self, *, running: bool) -> int:
        self.running = running
        self.writes = (self.writes + 1) % 128
        progress = 0 if running else 0x7FFF
        return self.operation << 24 | self.writes << 16 | int(running) << 15 | progress


class ControlProgram:
    """The program slot of the controller: empty, starting, or running the register loop."""

    def __init__(self, arm: Arm) -> None:
        self.registers = Registers()
        self.running = False
        self._arm = arm
        self._starts_at_s: float | None = None
        self._watchdog_s: float | None = None
        self._silent_s = 0.0
        self._stepped_s = 0.0
        self._heard_s = 0.0
        self._waits_for_rest = False
        self._progress = AsyncProgress()

    async def load(self, now_s: float) -> None:
        """Replace whatever runs by a freshly uploaded program."""
        await self.end("replaced by a new program")
        if self._arm.state.may_move:
            self._starts_at_s = now_s + PROGRAM_START_S

    async def end(self, reason: str) -> None:
        """End the program for a reason that a person should read, and stop the arm."""
        if self.running:
            sys.stderr.write(f"ur_controller: program ended: {reason}\n")
        await self._stop()

    async def _stop(self) -> None:
        self._starts_at_s = None
        if not self.running:
            return
        self.running = False
        self._watchdog_s = None
        self._finish_async()
        await self._arm.stop(PROGRAM_STOP_DECELERATION)

    async def step(self, now_s: float) -> None:
        """Run one controller cycle; `now_s` is real time."""
        if self._starts_at_s is not None and now_s >= self._starts_at_s:
            self._begin(now_s)
        if not self.running:
            return
        if not self._arm.state.may_move:
            await self.end(f"safety state {self._arm.state.safety}")
        elif self._watchdog_expired(now_s):
            await self.end("watchdog of input_int_register_0")
        else:
            await self._cycle()

    def _begin(self, now_s: float) -> None:
        self._starts_at_s = None
        self.running = True
        self._waits_for_rest = False
        self.registers.command_written_s = now_s
        self.registers.output_int[0] = READY
        self.registers.output_int[2] = self._progress.finish()

    def _watchdog_expired(self, now_s: float) -> bool:
        if self.registers.command_written_s != self._heard_s:
            self._heard_s = self.registers.command_written_s
            self._silent_s = 0.0
        else:
            self._silent_s += min(now_s - self._stepped_s, LONGEST_CYCLE_S)
        self._stepped_s = now_s
        return self._watchdog_s is not None and self._silent_s > self._watchdog_s

    async def _cycle(self) -> None:
        registers = self.registers
        command, state = registers.input_int[0], registers.output_int[0]
        if self._progress.running and not self._arm.state.moving:
            self._finish_async()
        if self._waits_for_rest:
            if not self._arm.state.moving:
                self._waits_for_rest = False
                registers.output_int[0] = DONE
        elif state == READY and command != 0:
            await self._execute(command)
        elif state == DONE and command == 0:
            registers.output_int[0] = READY

    async def _execute(self, command: int) -> None:
        registers = self.registers
        if command == MOVE_J:
            await self._move_j(registers)
        elif command in {STOP_J, STOP_L}:
            self._finish_async()
            await self._arm.stop(registers.input_double[0])
            self._waits_for_rest = True
        elif command == SET_WATCHDOG:
            self._watchdog_s = 1.0 / registers.input_double[0]
            registers.output_int[0] = DONE
        elif command == IS_STEADY:
            registers.output_int[1] = int(not self._arm.state.moving)
            registers.output_int[0] = DONE
        elif command == KICK_WATCHDOG:
            registers.output_int[0] = DONE
        elif command == STOP_SCRIPT:
            await self._stop()
        else:
            await self.end(f"command {command} is not emulated")

    async def _move_j(self, registers: Registers) -> None:
        joints = tuple(registers.input_double[:N_JOINTS])
        speed, acceleration = registers.input_double[N_JOINTS : N_JOINTS + 2]
        self._finish_async()
        try:
            await self._arm.move(joints, speed, acceleration)
        except WorldRefusedError as refusal:
            # A controller answers an impossible target by ending the program with a pop-up.
            await self.end(str(refusal))
            return
        if registers.input_int[1] == 1:
            registers.output_int[2] = self._progress.begin()
            registers.output_int[0] = DONE
        else:
            self._waits_for_rest = True

    def _finish_async(self) -> None:
        if self._progress.running:
            self.registers.output_int[2] = self._progress.finish()

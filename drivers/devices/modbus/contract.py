"""What driver and controller agree on: a profile's registers, turned into joints and commands.

A command is written in one request with a sequence number: the controller follows each number once,
so a lost or doubled request moves nothing twice. The check word, one constant in each direction,
shows a wrong word order or address before a wrong joint does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from drivers.devices.modbus.registers import Register
from drivers.errors import Refused
from drivers.interfaces import JointMotion, Safety
from drivers.modbus_link import Table
from drivers.profile_file import Profile, read_profile

CHECK_WORD = 0x01020304
SEQUENCES = 1 << 16
MOVE, STOP = 1, 2
UNITS = {"rad": 1.0, "deg": math.pi / 180, "m": 1.0, "mm": 1e-3}
COARSEST_STEP = 1e-5
"""[rad], [m]; 0.01 mm at 1 m, the class of a good tracker."""
SLOWEST_WATCHDOG_S = 0.25
"""With braking the robot must stand 0.3 s after the last heartbeat."""
LARGEST_READ, LARGEST_WRITE = 125, 123
"""Registers that one request may carry (Modbus Application Protocol V1.1b3, 6.3 and 6.12)."""
SINGLE_STATUS = (
    "check",
    "n_joints",
    "counter",
    "clock",
    "accepted",
    "done",
    "busy",
    "error",
    "safety",
)
SINGLE_COMMAND = ("check", "sequence", "speed", "acceleration", "command")
WHOLE = ("uint16", "uint32")


@dataclass(frozen=True)
class Status:
    """One look at the controller's registers."""

    check: int
    n_joints: int
    counter: int
    clock_s: float
    accepted: int
    done: int
    busy: bool
    error: int
    safety: int
    joints: tuple[float, ...]
    """[rad], [m]"""


class Contract:
    """A profile of the kind `robot`, for a robot of `n_joints` joints.

    Raises
    ------
    Refused
        If the profile is wrong, or reads joints too coarsely for calibration.
    """

    def __init__(self, device: str, name: str, n_joints: int) -> None:
        profile = read_profile(device, name)
        profile.choice("kind", "robot")
        self._device = device
        self._n_joints = n_joints
        self._big = profile.choice("word_order", "big", "little") == "big"
        self.unit = profile.whole("unit", 0, 255)
        if not 0.0 < profile.number("watchdog_s") <= SLOWEST_WATCHDOG_S:
            raise profile.wrong(
                "watchdog_s",
                f"is not within 0 to {SLOWEST_WATCHDOG_S:g} s, so that a killed driver stops the "
                "robot in time; shorten it in the robot's program too",
            )
        self.status_table = Table(profile.choice("status_table", *Table))
        self._clock_scale = profile.number("clock_scale_s")
        self._joint_scale, self._steps = self._read_scales(profile)
        status, command = profile.section("status"), profile.section("command")
        self._status = self._read_registers(status, SINGLE_STATUS)
        self._command = self._read_registers(command, SINGLE_COMMAND)
        self.heartbeat = Register.read(profile, "heartbeat", "uint16", big=self._big)
        self._safety = profile.words_by_code("safety")
        self._errors = profile.words_by_code("errors")
        self._check_words(profile)
        for section in (profile, status, command):
            section.end()
        self._check_resolution(status)
        self.status_places = self._places(status, self._status, LARGEST_READ)
        self.command_places = self._places(command, self._command, LARGEST_WRITE)

    def decode(self, block: Sequence[int]) -> Status:
        """Take a status block apart."""
        start = self.status_places.start
        one = {name: self._status[name].decode(block, start)[0] for name in SINGLE_STATUS}
        counts = self._status["joints"].decode(block, start, self._n_joints)
        return Status(
            int(one["check"]),
            int(one["n_joints"]),
            int(one["counter"]),
            one["clock"] * self._clock_scale,
            int(one["accepted"]),
            int(one["done"]),
            bool(one["busy"]),
            int(one["error"]),
            int(one["safety"]),
            tuple(count * step for count, step in zip(counts, self._steps, strict=True)),
        )

    def move_block(self, sequence: int, motion: JointMotion) -> list[int]:
        """Give the command block of a motion.

        Raises
        ------
        Refused
            If the motion is not one of this robot's, or does not fit into the registers.
        """
        numbers = (*motion.joints, motion.speed, motion.acceleration)
        if len(motion.joints) != self._n_joints or not all(map(math.isfinite, numbers)):
            raise Refused(
                self._device,
                "move",
                f"needs {self._n_joints} finite joint readings, speed and acceleration, "
                f"got {motion}",
            )
        counts = [q / step for q, step in zip(motion.joints, self._steps, strict=True)]
        try:
            return self._block(
                sequence,
                MOVE,
                counts,
                motion.speed / self._joint_scale,
                motion.acceleration / self._joint_scale,
            )
        except OverflowError as fault:
            raise Refused(self._device, "move", f"{fault}; choose another target") from fault

    def stop_block(self, sequence: int, deceleration: float) -> list[int]:
        """Give the command block of a stop with a deceleration [rad/s2]."""
        still = [0.0] * self._n_joints
        return self._block(sequence, STOP, still, 0.0, deceleration / self._joint_scale)

    def safety(self, status: Status) -> Safety:
        """Return the safety state; a code that the profile does not know allows no motion."""
        return Safety(self._safety.get(status.safety, Safety.not_ready))

    def explain(self, error: int) -> str:
        """Say what an error code means and what to do."""
        return f"error {error}: " + self._errors.get(error, "look it up in the robot's program")

    def _block(
        self,
        sequence: int,
        command: int,
        joints: Sequence[float],
        speed: float,
        acceleration: float,
    ) -> list[int]:
        block = [0] * len(self.command_places)
        values = {
            "check": [CHECK_WORD],
            "sequence": [sequence],
            "joints": joints,
            "speed": [speed],
            "acceleration": [acceleration],
            "command": [command],
        }
        for name, numbers in values.items():
            register = self._command[name]
            words = [word for number in numbers for word in register.encode(number)]
            first = register.address - self.command_places.start
            block[first : first + len(words)] = words
        return block

    def _read_scales(self, profile: Profile) -> tuple[float, tuple[float, ...]]:
        """Read what one count is in SI: of a joint that turns, and of each joint."""
        turns = profile.number("joint_scale") * UNITS[profile.choice("joint_unit", "rad", "deg")]
        slide_unit = UNITS[profile.choice("prismatic_unit", "m", "mm")]
        slides = profile.number("prismatic_scale") * slide_unit
        prismatic = profile.wholes("prismatic")
        steps = [slides if j in prismatic else turns for j in range(1, self._n_joints + 1)]
        return turns, tuple(steps)

    def _read_registers(self, section: Profile, singles: Sequence[str]) -> dict[str, Register]:
        fine = {"speed", "acceleration"}
        registers = {
            name: Register.read(section, name, *(() if name in fine else WHOLE), big=self._big)
            for name in singles
        }
        return {**registers, "joints": Register.read(section, "joints", big=self._big)}

    def _check_words(self, profile: Profile) -> None:
        unknown = set(self._safety.values()) - set(Safety)
        if unknown:
            raise profile.wrong("safety", f"names {sorted(unknown)[0]!r}, which is no safety state")

    def _check_resolution(self, status: Profile) -> None:
        for block in (self._status, self._command):
            if block["joints"].words != 2:
                raise status.wrong(
                    "joints",
                    "has 16 bits, as built-in maps have (1 mrad a count, which is 1 mm at 1 m): "
                    "useless for calibration; let the robot's program write joints in 32 bits",
                )
        coarsest = max(self._steps)
        if self._status["joints"].kind != "float32" and coarsest > COARSEST_STEP:
            raise status.wrong(
                "joints",
                f"has steps of {coarsest * 1e6:g} micrometre at 1 m: too coarse for calibration; "
                f"choose a scale of at most {COARSEST_STEP:g} rad or m",
            )

    def _places(self, section: Profile, registers: dict[str, Register], largest: int) -> range:
        taken: dict[int, str] = {}
        for name, register in registers.items():
            for place in register.places(self._n_joints if name == "joints" else 1):
                if place in taken:
                    raise section.wrong(name, f"lies over field {taken[place]} at {place}")
                taken[place] = name
        places = range(min(taken), max(taken) + 1)
        if len(places) > largest:
            raise section.wrong(
                "joints",
                f"and others spread over {len(places)} registers, one request carries {largest}",
            )
        return places

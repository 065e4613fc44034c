"""What a person types at an emulated cell or stage, followed line by line."""

import json
import os
import select
import sys
from collections.abc import Iterator, Mapping

from robocal.errors import BadInput
from service.child_process import StartFailed
from service.emulated_faults import FAULTS, Wire, switch
from service.emulated_stage import StageHands
from service.world_client import WorldClient

_TOUCH_WORDS = 5
_LOOK_S = 0.5
"""How often a program in the background looks whether it is in front again [s]."""
STDIN = 0


class CellHands:
    """A person at an emulated cell."""

    def __init__(self, wires: Mapping[str, Wire], world: WorldClient) -> None:
        self._wires = wires
        self._world = world

    def help(self) -> list[str]:
        """What may be typed."""
        faults = [
            f"  {part} {' | '.join(FAULTS[wire.driver])}"
            for part, wire in self._wires.items()
            if wire.emulator is not None
        ]
        return [
            "a fault of a part's wire, which lasts until none, or replies=N; delay_s=, code=:",
            *faults,
            "the world: set safety protective_stop, set safety normal, set beam_blocked true,",
            "  set temperature_degc 35, set payload_kg 5, set time_scale 20,",
            '  set effect {"effect": "backlash", "joint": 3, ...}, set effects []',
        ]

    def follow(self, line: str) -> str:
        """Do what a line says; what was done, in a sentence.

        Raises
        ------
        BadInput
            If it is not understood.
        """
        words = line.split()
        if words[0] == "set":
            return self._set(line)
        return switch(self._wires, words)

    def _set(self, line: str) -> str:
        _, _, rest = line.strip().partition(" ")
        name, _, text = rest.strip().partition(" ")
        reply = self._world.ask("set", name=name, value=value_of(text.strip()))
        if not reply["ok"]:
            raise BadInput(f"set {name}", reply["message"])
        return f"{name} is {text.strip()}"


class StagePerson:
    """A person at an emulated stage."""

    def __init__(self, wires: Mapping[str, Wire], stage: StageHands) -> None:
        self._wires = wires
        self._stage = stage

    def follow(self, line: str) -> str:
        """Do what a line says; what was done, in a sentence.

        Raises
        ------
        BadInput
            If it is not understood.
        """
        words = line.split()
        if words[0] == "faults":
            return self._bend(line.strip().partition(" ")[2])
        if words[0] in self._wires and len(words) > 1 and words[1] in self._known(words[0]):
            return switch(self._wires, words)
        if len(words) != _TOUCH_WORDS:
            raise BadInput(line.strip(), "five words are needed: master rod 0 0 350")
        robot, cup, slide, angle, length = words
        reply = self._stage.touch(
            robot, cup, slide_mm=slide, rod_angle_deg=angle, rod_length_mm=length
        )
        if not reply["ok"]:
            raise BadInput(line.strip(), reply["message"])
        return f"the {robot}'s needle sits in the {cup} cup"

    def _bend(self, text: str) -> str:
        reply = self._stage.ask("faults", faults=value_of(text))
        if not reply["ok"]:
            raise BadInput("stage", reply["message"])
        return f"the stage's hidden faults are {text}"

    def _known(self, part: str) -> Mapping[str, object]:
        return FAULTS.get(self._wires[part].driver, {})


def value_of(text: str) -> object:
    """JSON, or else a word as it stands."""
    try:
        value: object = json.loads(text)
    except ValueError:
        return text
    return value


def typed_lines() -> Iterator[str]:
    """Lines of standard input that say something, until its end.

    In the background of a terminal nothing is read: the system would stop the program.
    """
    pending = b""
    while True:
        if os.name == "posix" and not select.select([STDIN], [], [], _LOOK_S)[0]:
            continue
        if not _in_front():
            select.select([], [], [], _LOOK_S)
            continue
        received = os.read(STDIN, 4096)
        if not received:
            return
        *lines, pending = (pending + received).split(b"\n")
        yield from (line.decode("utf-8", "replace") for line in lines if line.strip())


def _in_front() -> bool:
    return not os.isatty(STDIN) or os.tcgetpgrp(STDIN) == os.getpgrp()


def converse(person: CellHands | StagePerson) -> None:
    """Follow what is typed until the end of input, each line with its answer."""
    for line in typed_lines():
        if line.strip() == "help" and isinstance(person, CellHands):
            said = "\n".join(person.help())
        else:
            try:
                said = person.follow(line)
            except (BadInput, StartFailed) as refusal:
                said = str(refusal)
        sys.stdout.write(f"{said}\n")
        sys.stdout.flush()

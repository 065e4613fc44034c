"""An NDI position sensor (Polaris, Vicra) on a serial port; its tool is the world's target.

``python -m drivers.emulators.ndi_camera --world HOST:PORT [--tools 1]`` prints one ready line with
its port. It knows INIT, COMM, VER, PHSR, PHRQ, PVWR, PINIT, PENA, PDIS, PHF, TSTART, TSTOP, TX, BX;
`--tools` wired tools are plugged in, a passive one can be loaded. The first tool is the target, all
others are missing. Beside the faults of every wire: `missing`, `disabled`, `code`,
`wrong_checksum`. Source: Polaris API Guide revision 5; nothing was compared with a real sensor.
"""

from __future__ import annotations

import argparse
import struct
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from drivers.emulators.ndi_wire import (
    BINARY_START,
    INVALID_COMMAND,
    INVALID_HANDLE,
    NOT_INITIALISED,
    PARAMETERS,
    WRONG_MODE,
    Command,
    CommandError,
    binary_reply,
    cut_commands,
    read_command,
    text_reply,
)
from drivers.emulators.serial_instrument import Protocol, instrument_options, play
from drivers.emulators.wire_faults import Fault
from drivers.emulators.world_link import WorldLink

BAUD = 9600
FRAMES_PER_S = 60
PORT_STATUS = 0x31
"""Tool in port, initialised, enabled."""
SEEN, MISSING, DISABLED = 1, 2, 4
VERSION = "Polaris Vicra Control Firmware, emulated\nNDI S/N: P6-00000\n"


@dataclass
class Tool:
    """One port handle."""

    loaded: bool = True
    initialised: bool = False
    enabled: bool = False


@dataclass
class Camera:
    """The instrument behind the wire."""

    world: WorldLink
    tools: dict[int, Tool]
    initialised: bool = False
    tracking: bool = False
    began_s: float = field(default_factory=time.monotonic)

    async def answer(self, line: bytes) -> bytes:
        """Follow one command."""
        try:
            command = read_command(line)
            if command.name in {"BX", "TX"}:
                return await self._track(command)
            return text_reply(self._follow(command))
        except CommandError as error:
            return text_reply(f"ERROR{error.code:02X}")

    def _follow(self, command: Command) -> str:
        known: dict[str, Callable[[str], str]] = {
            "INIT": self._initialise,
            "COMM": self._keep_speed,
            "VER": lambda _: VERSION,
            "PHSR": self._search,
            "PHRQ": self._request_handle,
            "PVWR": self._load,
            "PINIT": self._set_up,
            "PENA": self._enable,
            "PDIS": self._disable,
            "PHF": self._free,
            "TSTART": self._start,
            "TSTOP": self._stop,
        }
        if command.name not in known:
            raise CommandError(INVALID_COMMAND)
        if not self.initialised and command.name not in {"INIT", "COMM", "VER"}:
            raise CommandError(NOT_INITIALISED)
        return known[command.name](command.arguments)

    def _initialise(self, arguments: str) -> str:
        del arguments
        self.initialised, self.tracking = True, False
        for tool in self.tools.values():
            tool.initialised = tool.enabled = False
        return "OKAY"

    def _keep_speed(self, arguments: str) -> str:
        if arguments != "00000":
            raise CommandError(PARAMETERS)
        return "OKAY"

    def _search(self, arguments: str) -> str:
        choose: dict[str, Callable[[Tool], bool]] = {
            "00": lambda _: True,
            "01": lambda _: False,
            "02": lambda tool: not tool.initialised,
            "03": lambda tool: tool.initialised and not tool.enabled,
            "04": lambda tool: tool.enabled,
        }
        if arguments not in choose:
            raise CommandError(PARAMETERS)
        found = {number: tool for number, tool in self.tools.items() if choose[arguments](tool)}
        each = (f"{n:02X}{_port_status(tool):03X}" for n, tool in found.items())
        return f"{len(found):02X}" + "".join(each)

    def _request_handle(self, arguments: str) -> str:
        if len(arguments) != 14:
            raise CommandError(PARAMETERS)
        number = max(self.tools, default=0) + 1
        self.tools[number] = Tool(loaded=False)
        return f"{number:02X}"

    def _load(self, arguments: str) -> str:
        if len(arguments) != 2 + 4 + 128:
            raise CommandError(PARAMETERS)
        self._tool(arguments).loaded = True
        return "OKAY"

    def _set_up(self, arguments: str) -> str:
        self._must_not_track()
        self._tool(arguments).initialised = True
        return "OKAY"

    def _enable(self, arguments: str) -> str:
        self._must_not_track()
        tool = self._tool(arguments)
        if not tool.initialised or arguments[2:] not in {"S", "D", "B"}:
            raise CommandError(PARAMETERS)
        tool.enabled = True
        return "OKAY"

    def _disable(self, arguments: str) -> str:
        self._tool(arguments).enabled = False
        return "OKAY"

    def _free(self, arguments: str) -> str:
        self._tool(arguments)
        del self.tools[int(arguments, 16)]
        return "OKAY"

    def _start(self, arguments: str) -> str:
        del arguments
        self._must_not_track()
        self.tracking = True
        return "OKAY"

    def _stop(self, arguments: str) -> str:
        del arguments
        if not self.tracking:
            raise CommandError(WRONG_MODE)
        self.tracking = False
        return "OKAY"

    def _must_not_track(self) -> None:
        if self.tracking:
            raise CommandError(WRONG_MODE)

    def _tool(self, arguments: str) -> Tool:
        number = int(arguments[:2] or "0", 16)
        if number not in self.tools or not (self.tools[number].loaded or len(arguments) > 3):
            raise CommandError(INVALID_HANDLE)
        return self.tools[number]

    async def _track(self, command: Command) -> bytes:
        if not self.tracking:
            raise CommandError(WRONG_MODE if self.initialised else NOT_INITIALISED)
        if command.arguments not in {"", "0001", "0801"}:
            raise CommandError(PARAMETERS)
        pose: tuple[float, ...] | None = None
        reading = await self.world.ask("measure")
        if reading["ok"]:
            pose = (*reading["orientation"], *(x * 1e3 for x in reading["position"]))
        frame = int((time.monotonic() - self.began_s) * FRAMES_PER_S)
        seen = [(n, tool, pose if n == min(self.tools) else None) for n, tool in self._enabled()]
        if command.name == "BX":
            return binary_reply(
                bytes([len(seen)])
                + b"".join(_binary_tool(n, p, frame) for n, _, p in seen)
                + struct.pack("<H", 0)
            )
        each = "".join(_text_tool(n, p, frame) for n, _, p in seen)
        return text_reply(f"{len(seen):02X}{each}0000")

    def _enabled(self) -> list[tuple[int, Tool]]:
        return [(number, tool) for number, tool in self.tools.items() if tool.enabled]

    def without_tool(self, reply: bytes, fault: Fault) -> bytes:
        """Reply as when the tool is out of sight or was disabled; other replies stay true."""
        if not reply.startswith(BINARY_START):
            return reply
        handle = reply[7:8]
        if fault.fault == "disabled":
            return binary_reply(b"\x01" + handle + bytes([DISABLED]) + b"\x00\x00")
        frame = int((time.monotonic() - self.began_s) * FRAMES_PER_S)
        return binary_reply(b"\x01" + _binary_tool(handle[0], None, frame) + b"\x00\x00")

    def other_id(self, reply: bytes, fault: Fault) -> bytes:
        """Reply for a handle that was not asked for."""
        del fault
        if not reply.startswith(BINARY_START):
            return reply
        body = bytearray(reply[6:-2])
        body[1] += 1
        return binary_reply(bytes(body))


def _port_status(tool: Tool) -> int:
    return 0x01 | 0x10 * tool.initialised | 0x20 * tool.enabled


def _binary_tool(number: int, pose: tuple[float, ...] | None, frame: int) -> bytes:
    if pose is None:
        return struct.pack("<BBII", number, MISSING, PORT_STATUS, frame)
    return struct.pack("<BB8fII", number, SEEN, *pose, 0.0, PORT_STATUS, frame)


def _text_tool(number: int, pose: tuple[float, ...] | None, frame: int) -> str:
    tail = f"{PORT_STATUS:08X}{frame:08X}\n"
    if pose is None:
        return f"{number:02X}MISSING{tail}"
    turn = "".join(f"{round(q * 1e4):+06d}" for q in pose[:4])
    place = "".join(f"{round(x * 1e2):+07d}" for x in pose[4:])
    return f"{number:02X}{turn}{place}{0:+06d}{tail}"


def _wrong_checksum(reply: bytes, fault: Fault) -> bytes:
    del fault
    at = -1 if reply.startswith(BINARY_START) else -2
    return reply[:at] + bytes([reply[at] ^ 0x01]) + (b"" if at == -1 else reply[at + 1 :])


def _error(reply: bytes, fault: Fault) -> bytes:
    del reply
    return text_reply(f"ERROR{fault.code:02X}")


def make(world: WorldLink, options: argparse.Namespace) -> Protocol:
    """Put the sensor on the wire."""
    camera = Camera(world, {number + 1: Tool() for number in range(options.tools)})
    return Protocol(
        cut_commands,
        camera.answer,
        {
            "missing": camera.without_tool,
            "disabled": camera.without_tool,
            "wrong_id": camera.other_id,
            "wrong_checksum": _wrong_checksum,
            "code": _error,
        },
    )


def main() -> int:
    """Run a sensor."""
    parser = instrument_options("An emulated NDI position sensor on a serial port.", BAUD)
    parser.add_argument("--tools", type=int, default=1, help="wired tools plugged in")
    return play(parser, make)


if __name__ == "__main__":
    sys.exit(main())

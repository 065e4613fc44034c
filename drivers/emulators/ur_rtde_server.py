"""RTDE version 2 server of the emulated controller, TCP port 30004.

Every client is a `Session` with recipes of its own. Input registers belong to the first session
that asks for them, and are free again when it goes.
"""

import asyncio
import struct
import sys
from dataclasses import dataclass

from . import ur_wire as wire
from .ur_controller_state import Controller

PORT = 30004
CYCLE_HZ = 125.0
"""A CB3's rate; an e-series has 500 Hz, which would only cost computing time here."""
URCONTROL_VERSION = (5, 11, 1, 108318)
PROTOCOL_VERSION = 2
MAX_UNSENT_BYTES = 1 << 20


@dataclass(frozen=True)
class Recipe:
    """Fields of a data package, in order."""

    names: list[str]
    layout: struct.Struct


class RtdeServer:
    """All RTDE sessions of one controller."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self.sessions: set[Session] = set()
        self.input_owners: dict[str, Session] = {}

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Talk to one client until it goes."""
        session = Session(self, writer)
        self.sessions.add(session)
        try:
            while True:
                kind, payload = await wire.read_frame(reader)
                if not self.controller.faults.silent:
                    session.receive(kind, payload)
        except (asyncio.IncompleteReadError, ConnectionError):
            return
        finally:
            self.sessions.remove(session)
            owners = self.input_owners.items()
            self.input_owners = {name: owner for name, owner in owners if owner is not session}
            writer.close()

    def stream(self, cycle: int) -> None:
        """Send the data packages that are due in this cycle."""
        if self.controller.faults.silent:
            return
        for session in self.sessions:
            session.stream(cycle)

    @property
    def streaming(self) -> bool:
        """Whether any client waits for data packages."""
        return any(session.started for session in self.sessions)


class Session:
    """One RTDE client."""

    def __init__(self, server: RtdeServer, writer: asyncio.StreamWriter) -> None:
        self.started = False
        self._server = server
        self._writer = writer
        self._output: Recipe | None = None
        self._every = 1
        self._inputs: list[Recipe] = []
        self._answers = {
            wire.REQUEST_PROTOCOL_VERSION: self._negotiate,
            wire.GET_CONTROLLER_VERSION: self._version,
            wire.SETUP_OUTPUTS: self._setup_outputs,
            wire.SETUP_INPUTS: self._setup_inputs,
            wire.START: self._start,
            wire.PAUSE: self._pause,
        }

    def receive(self, kind: int, payload: bytes) -> None:
        """Act on one frame of the client."""
        if kind == wire.DATA_PACKAGE:
            self._write_inputs(payload)
        elif kind in self._answers:
            self._writer.write(wire.frame(kind, self._answers[kind](payload)))
        else:
            self._hang_up(f"frame type {kind} is not emulated")

    def stream(self, cycle: int) -> None:
        """Send a data package if one is due."""
        if not self.started or self._output is None or cycle % self._every:
            return
        if self._writer.transport.get_write_buffer_size() > MAX_UNSENT_BYTES:
            self._hang_up("client does not read")
            return
        values = [self._server.controller.output(name) for name in self._output.names]
        package = b"\x01" + wire.pack_values(self._output.layout, values)
        self._writer.write(wire.frame(wire.DATA_PACKAGE, package))

    def _hang_up(self, reason: str) -> None:
        sys.stderr.write(f"ur_controller: RTDE session closed: {reason}\n")
        self._writer.close()

    def _negotiate(self, payload: bytes) -> bytes:
        return bytes([payload == struct.pack(">H", PROTOCOL_VERSION)])

    def _version(self, _payload: bytes) -> bytes:
        return struct.pack(">4I", *URCONTROL_VERSION)

    def _setup_outputs(self, payload: bytes) -> bytes:
        (frequency,) = struct.unpack_from(">d", payload)
        names = _names(payload[8:])
        kinds = [wire.output_type(name) for name in names]
        if wire.NOT_FOUND in kinds:
            return bytes([0]) + ",".join(kinds).encode()
        self._output = Recipe(names, wire.payload_format(kinds))
        self._every = max(1, round(CYCLE_HZ / frequency))
        return bytes([1]) + ",".join(kinds).encode()

    def _setup_inputs(self, payload: bytes) -> bytes:
        names = _names(payload)
        owners = self._server.input_owners
        kinds = [
            wire.IN_USE if owners.get(name, self) is not self else wire.input_type(name)
            for name in names
        ]
        if wire.IN_USE in kinds or wire.NOT_FOUND in kinds:
            return bytes([0]) + ",".join(kinds).encode()
        owners.update(dict.fromkeys(names, self))
        # One name for each number, so that a vector's name stands six times.
        fields = zip(names, kinds, strict=True)
        numbers = [name for name, kind in fields for _ in range(wire.WIDTHS.get(kind, 1))]
        self._inputs.append(Recipe(numbers, wire.payload_format(kinds)))
        return bytes([len(self._inputs)]) + ",".join(kinds).encode()

    def _start(self, _payload: bytes) -> bytes:
        self.started = self._output is not None
        return bytes([self.started])

    def _pause(self, _payload: bytes) -> bytes:
        self.started = False
        return bytes([1])

    def _write_inputs(self, payload: bytes) -> None:
        if not 1 <= payload[0] <= len(self._inputs):
            self._hang_up(f"input recipe {payload[0]} was never set up")
            return
        recipe = self._inputs[payload[0] - 1]
        registers = self._server.controller.program.registers
        for name, value in zip(recipe.names, recipe.layout.unpack(payload[1:]), strict=True):
            if name.startswith("input_int_"):
                registers.input_int[wire.register_index(name)] = value
            elif name.startswith("input_double_"):
                registers.input_double[wire.register_index(name)] = value
        if "input_int_register_0" in recipe.names:
            registers.command_written_s = asyncio.get_running_loop().time()


def _names(listed: bytes) -> list[str]:
    # ur_rtde leaves a comma behind the last name of its output list.
    return [name for name in listed.decode().split(",") if name]

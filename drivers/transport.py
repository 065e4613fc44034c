"""Sockets and serial ports with deadlines and clear errors, and the one place that retries reads.

A retry is for idempotent reads only: whoever calls `read_again` says so by calling it. A motion
command never goes through it.
"""

from __future__ import annotations

import json
import re
import socket
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import serial

from drivers.errors import BadReply, NoReply, Unreachable

T = TypeVar("T")

READ_ATTEMPTS = 3
LARGEST_LINE = 1 << 20
"""A line longer than this is no reply of any device here [bytes]."""
PATIENCE = 3.0
"""How many times as long as it should be silent a line is listened to."""
LATE_REPLIES = 2.0
"""After a missing reply the line must be silent for so many times the longest reply."""
EIGHT_BITS = "8N1"
FRAME = re.compile("([78])([NEO])([12])")


def read_again(read: Callable[[], T]) -> T:
    """Do an idempotent read, again after a missing or garbled reply, `READ_ATTEMPTS` in all."""
    for _ in range(READ_ATTEMPTS - 1):
        try:
            return read()
        except (NoReply, BadReply):
            continue
    return read()


def split_address(device: str, address: str) -> tuple[str, int]:
    """Take ``host:port`` apart.

    Raises
    ------
    Unreachable
        If the address has another form.
    """
    host, colon, port = address.rpartition(":")
    if not colon or not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise Unreachable(device, "connect", f"address {address!r} is not of the form host:port")
    return host, int(port)


def open_socket(device: str, address: str, timeout_s: float) -> socket.socket:
    """Connect to ``host:port`` over TCP, with `timeout_s` [s] for this and every later call."""
    host, port = split_address(device, address)
    try:
        opened = socket.create_connection((host, port), timeout_s)
    except OSError as fault:
        raise Unreachable(
            device,
            "connect",
            f"no connection to {address} ({fault.strerror or fault}); check that it is switched "
            "on and that the address is right",
        ) from fault
    opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return opened


def open_serial(
    device: str, port: str, baud: int, timeout_s: float, frame: str = EIGHT_BITS
) -> serial.Serial:
    """Open a serial port for this program alone, reads ending after `timeout_s` [s].

    `frame` names data bits, parity and stop bits as instruments do: ``8N1``, ``7E1``.
    """
    form = FRAME.fullmatch(frame)
    if form is None:
        raise Unreachable(device, "connect", f"serial frame {frame!r} is not of the form 8N1")
    bits, parity, stop_bits = form.groups()
    try:
        return serial.Serial(
            port,
            baud,
            int(bits),
            parity,
            int(stop_bits),
            timeout=timeout_s,
            write_timeout=timeout_s,
            exclusive=True,
        )
    except (serial.SerialException, OSError) as fault:
        raise Unreachable(
            device,
            "connect",
            f"serial port {port} does not open ({fault}); check the cable, the port's name and "
            "that no other program uses it",
        ) from fault


def wait_for_silence(port: serial.Serial, quiet_s: float) -> bytes:
    """Read until nothing has come for `quiet_s` [s]; return what still comes when patience ends.

    Where replies carry no number, a late one can only be told from the next by waiting until no
    late one can be left: choose `quiet_s` longer than the device may take beyond its time.
    """
    end = time.monotonic() + PATIENCE * quiet_s
    quiet_at = time.monotonic() + quiet_s
    while (now := time.monotonic()) < quiet_at:
        received = port.read(port.in_waiting or 1)
        if received and now > end:
            return received
        if received:
            quiet_at = time.monotonic() + quiet_s
    return b""


class LineSocket:
    """One request line, one reply line over TCP.

    After a missing or broken reply the connection is dropped, since a late reply would be taken
    for the answer to the next request; the next request opens a new one, unless it was closed.
    """

    def __init__(self, device: str, address: str, timeout_s: float) -> None:
        self._device = device
        self._address = address
        self._timeout_s = timeout_s
        self._socket: socket.socket | None = None
        self._wanted = False
        self._received = b""

    @property
    def wanted(self) -> bool:
        """Whether it was opened and not closed since; a lost connection stays wanted."""
        return self._wanted

    def open(self) -> None:
        """Connect if not connected."""
        self._wanted = True
        self._connected()

    def close(self) -> None:
        """Disconnect if connected."""
        self._wanted = False
        self.drop()

    def drop(self) -> None:
        """Give up this connection; the next request opens another."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None
        self._received = b""

    def _connected(self) -> socket.socket:
        if not self._wanted:
            raise Unreachable(self._device, "connect", "not connected; call connect first")
        if self._socket is None:
            self._socket = open_socket(self._device, self._address, self._timeout_s)
        return self._socket

    def ask(self, command: str, line: bytes) -> bytes:
        """Send one line and return the line that comes back, both without line end.

        Raises
        ------
        Unreachable
            If there is no connection and none can be made.
        NoReply
            If the connection is lost or silent.
        """
        connected = self._connected()
        try:
            connected.sendall(line + b"\n")
            return self._receive_line(connected)
        except TimeoutError as fault:
            raise self._lost(command, f"no reply within {self._timeout_s:g} s") from fault
        except OSError as fault:
            raise self._lost(command, f"connection lost ({fault.strerror or fault})") from fault

    def _receive_line(self, connected: socket.socket) -> bytes:
        while b"\n" not in self._received:
            chunk = connected.recv(65536)
            if not chunk or len(self._received) > LARGEST_LINE:
                raise ConnectionResetError("closed by the other side in the middle of a reply")
            self._received += chunk
        line, _, self._received = self._received.partition(b"\n")
        return line

    def _lost(self, command: str, reason: str) -> NoReply:
        raw = self._received
        self.drop()
        return NoReply(self._device, command, reason, raw)


@dataclass(frozen=True)
class JsonReply:
    """One JSON object that a device sent, with typed looks at its fields."""

    device: str
    command: str
    fields: Mapping[str, Any]
    raw: bytes

    def number(self, name: str) -> float:
        """Read a field that must be a number."""
        value = self.fields.get(name)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self._bad(name, "a number")
        return float(value)

    def numbers(self, name: str) -> tuple[float, ...]:
        """Read a field that must be a list of numbers."""
        values = self.fields.get(name)
        if not isinstance(values, list) or not all(isinstance(v, int | float) for v in values):
            raise self._bad(name, "a list of numbers")
        return tuple(float(v) for v in values)

    def word(self, name: str) -> str:
        """Read a field that must be text."""
        value = self.fields.get(name)
        if not isinstance(value, str):
            raise self._bad(name, "text")
        return value

    def yes(self, name: str) -> bool:
        """Read a field that must be true or false."""
        value = self.fields.get(name)
        if not isinstance(value, bool):
            raise self._bad(name, "true or false")
        return value

    def part(self, name: str) -> JsonReply:
        """Read a field that must be an object."""
        value = self.fields.get(name)
        if not isinstance(value, dict):
            raise self._bad(name, "an object")
        return JsonReply(self.device, self.command, value, self.raw)

    def _bad(self, name: str, kind: str) -> BadReply:
        return BadReply(self.device, self.command, f"field {name} is not {kind}", self.raw)


def ask_json(line: LineSocket, device: str, command: str, request: Mapping[str, Any]) -> JsonReply:
    """Send one JSON object and return the JSON object that comes back."""
    raw = line.ask(command, json.dumps(request).encode())
    try:
        fields = json.loads(raw)
    except ValueError as fault:
        line.drop()
        raise BadReply(device, command, "the reply is not JSON", raw) from fault
    if not isinstance(fields, dict):
        line.drop()
        raise BadReply(device, command, "the reply is not a JSON object", raw)
    return JsonReply(device, command, fields, raw)

"""One Modbus unit over TCP or a serial line, through `pymodbus`, with typed errors.

`pymodbus` reports a garbled reply and a missing one alike, answers an exception reply without
raising, retries by itself and logs each failure in 25 lines; here every failure becomes one error
with the bytes that came, and nothing is retried. Source: Modbus Application Protocol V1.1b3.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from enum import StrEnum

from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ConnectionException, ModbusIOException
from pymodbus.pdu import ExceptionResponse, ModbusPDU

from drivers.errors import BadReply, DriverError, NoReply, Refused, Unreachable
from drivers.transport import (
    LATE_REPLIES,
    open_serial,
    open_socket,
    split_address,
    wait_for_silence,
)

logging.getLogger("pymodbus.logging").setLevel(logging.CRITICAL + 1)

EXCEPTIONS = {
    1: "illegal function: it does not know this kind of request; check the profile's table",
    2: "illegal data address: it has no such register; check the profile's addresses",
    3: "illegal data value: it does not take this value or this number of registers",
    4: "device failure: read its own display or log",
    5: "acknowledge: it needs longer; ask again later",
    6: "busy: ask again later",
    8: "memory parity error: it needs service",
    10: "gateway path unavailable: check the gateway's settings",
    11: "the device behind the gateway does not answer: check its power, cable and id",
}


class Table(StrEnum):
    """Which of a unit's tables of registers."""

    holding = "holding"
    input = "input"


class ModbusLink:
    """Reads and writes registers of one unit; opened again after a loss.

    Use `over_tcp` or `over_serial` to make one.
    """

    def __init__(
        self,
        device: str,
        unit: int,
        open_client: Callable[[ModbusLink], ModbusTcpClient | ModbusSerialClient],
        check: str,
    ) -> None:
        self._device = device
        self._unit = unit
        self._open_client = open_client
        self._check = check
        self._client: ModbusTcpClient | ModbusSerialClient | None = None
        self._wanted = False
        self._doubtful = False
        self._received = b""

    @property
    def is_open(self) -> bool:
        """Whether there is a connection now."""
        return self._client is not None

    @property
    def wanted(self) -> bool:
        """Whether it was opened and not closed since; a lost connection stays wanted."""
        return self._wanted

    def open(self) -> None:
        """Connect if not connected."""
        self._wanted = True
        self._opened("connect")

    def close(self) -> None:
        """Disconnect if connected."""
        self._wanted = False
        self.drop()

    def drop(self) -> None:
        """Give up this connection; the next request opens another."""
        if self._client is not None:
            self._client.close()  # type: ignore[no-untyped-call]
            self._client = None

    def read(self, command: str, table: Table, address: int, count: int) -> tuple[int, ...]:
        """Read `count` registers of 16 bits in one request (function 3 or 4).

        Raises
        ------
        Unreachable, NoReply, BadReply, Refused
            As for every driver; `Refused` with the meaning of the unit's exception code.
        """
        client = self._opened(command)
        ask = (
            client.read_holding_registers if table is Table.holding else client.read_input_registers
        )
        reply = self._call(command, lambda: ask(address, count=count, device_id=self._unit))
        if len(reply.registers) != count:
            raise self._bad(command, f"{len(reply.registers)} registers came and not {count}")
        return tuple(reply.registers)

    def write(self, command: str, address: int, values: Sequence[int]) -> None:
        """Write registers in one request (function 16); raises like `read`."""
        client = self._opened(command)
        self._call(
            command,
            lambda: client.write_registers(address, list(values), device_id=self._unit),
        )

    def trace(self, sending: bool, frame: bytes) -> bytes:  # noqa: FBT001 - pymodbus calls it so
        """Remember what came in, for error messages."""
        self._received = b"" if sending else frame
        return frame

    def _call(self, command: str, request: Callable[[], ModbusPDU]) -> ModbusPDU:
        self._received = b""
        try:
            reply = request()
        except (ConnectionException, OSError) as fault:
            # A reset comes through pymodbus as it is.
            raise self._lost(command) from fault
        except ModbusIOException as fault:
            raise self._missing(command) from fault
        if isinstance(reply, ExceptionResponse):
            code = reply.exception_code
            meaning = EXCEPTIONS.get(code, "look it up in the device's manual")
            raise Refused(
                self._device, command, f"exception {code}, {meaning}", bytes(self._received)
            )
        return reply

    def _lost(self, command: str) -> DriverError:
        serial = isinstance(self._client, ModbusSerialClient)
        self.drop()
        if serial:
            return Unreachable(
                self._device, command, f"the serial port is gone; plug it in again, {self._check}"
            )
        return NoReply(self._device, command, f"the connection was cut; {self._check}")

    def _missing(self, command: str) -> DriverError:
        if self._received:
            return self._bad(command, "the reply is cut, garbled or another unit's")
        self._give_up()
        return NoReply(self._device, command, f"no reply in time; check its power, {self._check}")

    def _bad(self, command: str, what: str) -> BadReply:
        self._give_up()
        return BadReply(self._device, command, f"{what}; {self._check}", bytes(self._received))

    def _give_up(self) -> None:
        """Make sure that no late reply is taken for the next one."""
        if isinstance(self._client, ModbusSerialClient):
            self._doubtful = True
        else:
            self.drop()

    def _opened(self, command: str) -> ModbusTcpClient | ModbusSerialClient:
        if not self._wanted:
            raise Unreachable(self._device, command, "not connected; call connect first")
        if self._client is None:
            self._client = self._open_client(self)
            self._doubtful = False
        if self._doubtful:
            self._wait_for_silence(command)
        return self._client

    def _wait_for_silence(self, command: str) -> None:
        """Let late replies pass: an RTU reply carries no number."""
        assert isinstance(self._client, ModbusSerialClient)
        port = self._client.socket
        assert port is not None
        try:
            noise = wait_for_silence(port, LATE_REPLIES * self._client.comm_params.timeout_connect)
        except OSError as fault:
            raise self._lost(command) from fault
        if noise:
            self._received = noise
            raise self._bad(command, "the line is never silent")
        self._doubtful = False


def over_tcp(device: str, address: str, unit: int, timeout_s: float) -> ModbusLink:
    """Make a link to ``host:port``; it is yet to be opened."""
    host, port = split_address(device, address)

    def open_client(link: ModbusLink) -> ModbusTcpClient:
        client = ModbusTcpClient(
            host, port=port, timeout=timeout_s, retries=0, trace_packet=link.trace
        )
        client.socket = open_socket(device, address, timeout_s)
        return client

    return ModbusLink(device, unit, open_client, f"check the network and unit id {unit}")


def over_serial(
    device: str, port: str, baud: int, frame: str, unit: int, timeout_s: float
) -> ModbusLink:
    """Make a link to a unit on a serial line (RTU); it is yet to be opened."""

    def open_client(link: ModbusLink) -> ModbusSerialClient:
        client = ModbusSerialClient(
            port, baudrate=baud, timeout=timeout_s, retries=0, trace_packet=link.trace
        )
        # Opened here and not by pymodbus, which keeps the reason of a failure to itself.
        client.socket = open_serial(device, port, baud, timeout_s, frame)
        return client

    return ModbusLink(
        device, unit, open_client, f"check the cable, unit id {unit} and {baud} baud {frame}"
    )

"""Modbus TCP by hand: frames, register reads and writes, and what can go wrong on the wire.

Written without any library, so that the drivers' library is held against something else. Source:
Modbus Messaging on TCP/IP V1.0b, section 3; Modbus Application Protocol V1.1b3, sections 6.3, 6.4,
6.6 and 6.12.
"""

from __future__ import annotations

import asyncio
import socket
import struct
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace
from typing import Protocol

READ_HOLDING, READ_INPUT, WRITE_ONE, WRITE_MANY = 3, 4, 6, 16
ILLEGAL_FUNCTION, ILLEGAL_ADDRESS = 1, 2
HEADER = struct.Struct(">HHHB")
"""Transaction, protocol, bytes that follow, unit."""
NOISE = b"\xff\x00~g#\x81,:\r\nnoise"
KINDS = (
    "none",
    "silence",
    "late_reply",
    "cut_reply",
    "noise",
    "wrong_id",
    "wrong_transaction",
    "code",
    "reset",
    "closed",
    "half_open",
    "frozen",
    "refused",
)


@dataclass(frozen=True)
class Fault:
    """What goes wrong with the next replies; `half_open`, `frozen` and `refused` last."""

    fault: str = "none"
    delay_s: float = 0.0
    code: int = 0
    replies: int = 1

    def __post_init__(self) -> None:
        """Refuse a fault that is not known."""
        if self.fault not in KINDS:
            raise ValueError(f"fault must be one of {', '.join(KINDS)}")

    def used(self) -> Fault:
        """Return the fault with one reply less to spoil."""
        return replace(self, replies=self.replies - 1) if self.replies > 1 else Fault()


class Registers(Protocol):
    """What stands behind the wire."""

    async def read(self, function: int, address: int, count: int) -> list[int] | None:
        """Return registers, None where there are none."""
        ...

    async def write(self, address: int, values: list[int]) -> bool:
        """Write registers; False where there are none."""
        ...


class ModbusServer:
    """A listening port that misbehaves on request."""

    def __init__(self, registers: Registers, unit: int) -> None:
        self._registers = registers
        self._unit = unit
        self._writers: set[asyncio.StreamWriter] = set()
        self._server: asyncio.Server | None = None
        self.fault = Fault()
        self.port = 0

    async def open(self, port: int) -> None:
        """Listen."""
        self._server = await asyncio.start_server(self._converse, "127.0.0.1", port)
        self.port = self._server.sockets[0].getsockname()[1]

    def close(self) -> None:
        """Stop listening and cut every connection."""
        if self._server is not None:
            self._server.close()
            self._server = None
        for writer in self._writers:
            writer.close()

    async def switch(self, fault: Fault) -> None:
        """Change what goes wrong."""
        self.fault = fault
        if fault.fault == "refused":
            self.close()
        elif self._server is None:
            await self.open(self.port)

    async def _converse(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._writers.add(writer)
        try:
            while True:
                head = await reader.readexactly(HEADER.size)
                transaction, _, length, unit = HEADER.unpack(head)
                request = await reader.readexactly(length - 1)
                if self.fault.fault == "half_open":
                    continue
                answer = await self._answer(request)
                if unit == self._unit and not await self._reply(writer, transaction, answer):
                    return
        except (asyncio.IncompleteReadError, ConnectionError, asyncio.CancelledError):
            return  # A client that has gone is no event here; the controller watches the beat.
        finally:
            self._writers.discard(writer)
            writer.close()

    async def _reply(self, writer: asyncio.StreamWriter, transaction: int, answer: bytes) -> bool:
        """Send the reply, spoilt if a fault is due; False where the connection has ended."""
        fault = self.fault
        if fault.fault not in {"none", "frozen", "half_open"}:
            self.fault = fault.used()
        await asyncio.sleep(fault.delay_s)
        unit = self._unit
        match fault.fault:
            case "silence":
                return True
            case "reset":
                _send_reset(writer)
                return False
            case "closed":
                return False
            case "wrong_id":
                unit += 1
            case "wrong_transaction":
                transaction = (transaction + 1) % 65536
            case "code":
                answer = bytes([answer[0] | 0x80, fault.code])
        frame = HEADER.pack(transaction, 0, len(answer) + 1, unit) + answer
        if fault.fault == "cut_reply":
            frame = frame[: len(frame) // 2]
        writer.write(NOISE if fault.fault == "noise" else frame)
        await writer.drain()
        return True

    async def _answer(self, request: bytes) -> bytes:
        function = request[0]
        followers: dict[int, Callable[[bytes], Awaitable[bytes | None]]] = {
            READ_HOLDING: self._read,
            READ_INPUT: self._read,
            WRITE_ONE: self._write_one,
            WRITE_MANY: self._write_many,
        }
        if function not in followers:
            return bytes([function | 0x80, ILLEGAL_FUNCTION])
        answer = await followers[function](request)
        return bytes([function | 0x80, ILLEGAL_ADDRESS]) if answer is None else answer

    async def _read(self, request: bytes) -> bytes | None:
        function, address, count = struct.unpack(">BHH", request)
        values = await self._registers.read(function, address, count)
        if values is None:
            return None
        return struct.pack(f">BB{count}H", function, 2 * count, *values)

    async def _write_one(self, request: bytes) -> bytes | None:
        _, address, value = struct.unpack(">BHH", request)
        return request if await self._registers.write(address, [value]) else None

    async def _write_many(self, request: bytes) -> bytes | None:
        _, address, count, _ = struct.unpack(">BHHB", request[:6])
        values = list(struct.unpack(f">{count}H", request[6:]))
        return request[:5] if await self._registers.write(address, values) else None


def _send_reset(writer: asyncio.StreamWriter) -> None:
    """Cut so that the other side gets a reset and no orderly end."""
    opened: socket.socket = writer.get_extra_info("socket")
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    writer.transport.abort()

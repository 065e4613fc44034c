"""Modbus RTU frames by hand: unit id, function, body, CRC-16 (low byte first).

Written without any library, so that the drivers' library is held against something else. Source:
Modbus over Serial Line V1.02, section 2.5 and appendix B.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from drivers.emulators.wire_faults import Fault, Spoil

READ_HOLDING, READ_INPUT = 3, 4
FRAME_BYTES = 8
"""Every request that these instruments know is this long."""
ILLEGAL_FUNCTION, ILLEGAL_ADDRESS = 1, 2


def crc16(frame: bytes) -> bytes:
    """CRC-16/MODBUS, polynomial 0x8005 reflected, start 0xFFFF, as it goes over the wire."""
    crc = 0xFFFF
    for byte in frame:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0xA001 if crc & 1 else crc >> 1
    return struct.pack("<H", crc)


def cut_frames(pending: bytes) -> tuple[list[bytes], bytes]:
    """Cut into requests; a real unit would cut at pauses, which a pseudo-terminal has not."""
    frames = []
    while len(pending) >= FRAME_BYTES:
        frame = pending[:FRAME_BYTES]
        if crc16(frame[:-2]) == frame[-2:]:
            frames.append(frame)
            pending = pending[FRAME_BYTES:]
        else:
            pending = pending[1:]
    return frames, pending


@dataclass(frozen=True)
class Unit:
    """A unit that answers reads of registers from two tables that are filled on request."""

    number: int

    def answer(
        self, request: bytes, tables: Mapping[int, Callable[[], Mapping[int, int]]]
    ) -> bytes:
        """Return the reply frame; empty for another unit's request."""
        number, function, address, count = struct.unpack(">BBHH", request[:6])
        if number != self.number:
            return b""
        if function not in tables:
            return self.exception(function, ILLEGAL_FUNCTION)
        registers = tables[function]()
        wanted = range(address, address + count)
        if not count or not set(wanted) <= registers.keys():
            return self.exception(function, ILLEGAL_ADDRESS)
        values = struct.pack(f">{count}H", *(registers[place] for place in wanted))
        return _checked(struct.pack(">BBB", number, function, len(values)) + values)

    def exception(self, function: int, code: int) -> bytes:
        """Return an exception reply."""
        return _checked(struct.pack(">BBB", self.number, function | 0x80, code))

    def spoils(self) -> dict[str, Spoil]:
        """Faults that RTU has beyond those of every wire."""
        return {
            "wrong_checksum": lambda reply, _: reply[:-1] + bytes([reply[-1] ^ 0xFF]),
            "wrong_id": lambda reply, _: _checked(bytes([reply[0] + 1]) + reply[1:-2]),
            "code": self._refuse,
        }

    def _refuse(self, reply: bytes, fault: Fault) -> bytes:
        return self.exception(reply[1], fault.code)


def _checked(frame: bytes) -> bytes:
    return frame + crc16(frame)

"""RTDE version 2 on the wire: frames, field types, and nothing about what the values mean.

A frame is ``uint16 size`` (of the whole frame), ``uint8 type``, payload; all numbers big-endian.
Source: Universal Robots, "Real-Time Data Exchange (RTDE) Guide".
"""

import asyncio
import struct

HEADER = struct.Struct(">HB")

REQUEST_PROTOCOL_VERSION = ord("V")
GET_CONTROLLER_VERSION = ord("v")
SETUP_OUTPUTS = ord("O")
SETUP_INPUTS = ord("I")
START = ord("S")
PAUSE = ord("P")
DATA_PACKAGE = ord("U")

NOT_FOUND = "NOT_FOUND"
IN_USE = "IN_USE"

FORMATS = {
    "INT32": "i",
    "UINT32": "I",
    "DOUBLE": "d",
    "VECTOR6D": "6d",
}
WIDTHS = {"VECTOR6D": 6}
"""Numbers in a value, where it is not one."""

OUTPUT_TYPES = {
    "timestamp": "DOUBLE",
    "actual_q": "VECTOR6D",
    "actual_qd": "VECTOR6D",
    "target_q": "VECTOR6D",
    "target_qd": "VECTOR6D",
    "robot_mode": "INT32",
    "safety_mode": "INT32",
    "robot_status_bits": "UINT32",
    "safety_status_bits": "UINT32",
    "runtime_state": "UINT32",
}
INPUT_TYPES = {"external_force_torque": "VECTOR6D"}
"""Taken without effect: `ur_rtde` sets it up at every connection."""
N_REGISTERS = 48

Value = int | float | tuple[float, ...]


def output_type(name: str) -> str:
    """Return the type of an output field, `NOT_FOUND` for one that this controller lacks."""
    return OUTPUT_TYPES.get(name) or _register_type(name, "output_")


def input_type(name: str) -> str:
    """Return the type of an input field, `NOT_FOUND` for one that this controller lacks."""
    return INPUT_TYPES.get(name) or _register_type(name, "input_")


def register_index(name: str) -> int:
    """Return the number at the end of a register's name."""
    return int(name.rpartition("_")[2])


def _register_type(name: str, direction: str) -> str:
    for word, kind in (("int", "INT32"), ("double", "DOUBLE")):
        prefix = f"{direction}{word}_register_"
        number = name.removeprefix(prefix)
        if number != name and number.isdigit() and int(number) < N_REGISTERS:
            return kind
    return NOT_FOUND


def payload_format(kinds: list[str]) -> struct.Struct:
    """Return the layout of a data package's values."""
    return struct.Struct(">" + "".join(FORMATS[kind] for kind in kinds))


def frame(kind: int, payload: bytes) -> bytes:
    """Build one frame."""
    return HEADER.pack(HEADER.size + len(payload), kind) + payload


def pack_values(layout: struct.Struct, values: list[Value]) -> bytes:
    """Pack values in the order of their recipe, vectors flattened."""
    flat: list[float] = []
    for value in values:
        if isinstance(value, tuple):
            flat.extend(value)
        else:
            flat.append(value)
    return layout.pack(*flat)


async def read_frame(reader: asyncio.StreamReader) -> tuple[int, bytes]:
    """Read one frame.

    Raises
    ------
    asyncio.IncompleteReadError
        The client has gone.
    """
    size, kind = HEADER.unpack(await reader.readexactly(HEADER.size))
    return kind, await reader.readexactly(size - HEADER.size)

"""GeoCOM's ASCII lines: bytes to requests, replies to bytes.

``%R1Q,<rpc>[,<transaction>[,<checksum>]]:<parameters>`` is answered by
``%R1P,<communication code>,<transaction>[,<checksum>]:<return code>[,<values>]``, lines end with
CR LF. The checksum is CRC-16/ARC in decimal over the line without ``,<checksum>``; a reply has one
if its request had one. Source: Leica GeoCOM Reference Manual TPS1200/TS30/TM30 v1.50.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

LINE_END = b"\r\n"
ABORT_MOTION = b"c"

OK = 0
WRONG_FORMAT = 3078
NO_SUCH_PROCEDURE = 3081
BAD_REQUEST_CHECKSUM = 3101

REQUEST = re.compile(r"^%R1Q,(\d+)(?:,(\d+)(?:,(\d+))?)?:(.*)$")


@dataclass(frozen=True)
class Request:
    """One call of a remote procedure."""

    procedure: int
    transaction: int
    checked: bool
    """Whether it carried a checksum, so that the reply must carry one."""
    parameters: tuple[str, ...]


@dataclass(frozen=True)
class Reply:
    """What a procedure returned: its code and its values, already as text."""

    code: int
    values: tuple[str, ...] = ()


class RequestError(Exception):
    """A line that is no request; `code` is the communication code to answer with."""

    def __init__(self, code: int, transaction: int) -> None:
        super().__init__(f"code {code}")
        self.code = code
        self.transaction = transaction


def crc16(line: str) -> int:
    """CRC-16/ARC: polynomial 0x8005 reflected, start 0."""
    crc = 0
    for byte in line.encode("ascii"):
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0xA001 if crc & 1 else crc >> 1
    return crc


def read_request(line: bytes) -> Request:
    """Take a request line apart and compare its checksum."""
    found = REQUEST.match(line.decode("ascii", "replace"))
    if found is None:
        raise RequestError(WRONG_FORMAT, 0)
    procedure, transaction, checksum, parameters = found.groups()
    if checksum is not None and int(checksum) != crc16(
        f"%R1Q,{procedure},{transaction}:{parameters}"
    ):
        raise RequestError(BAD_REQUEST_CHECKSUM, int(transaction))
    return Request(
        int(procedure),
        int(transaction or 0),
        checksum is not None,
        tuple(parameters.split(",")) if parameters else (),
    )


def reply_line(communication: int, request: Request, reply: Reply) -> bytes:
    """Put a reply on the wire."""
    head = f"%R1P,{communication},{request.transaction}"
    tail = ":" + ",".join((str(reply.code), *reply.values))
    checksum = f",{crc16(head + tail)}" if request.checked else ""
    return (head + checksum + tail).encode("ascii") + LINE_END

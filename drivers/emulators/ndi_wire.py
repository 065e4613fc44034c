"""NDI's combined API on the wire: commands to words, replies to bytes.

A command is ``NAME:arguments`` with four hexadecimal digits of CRC, or ``NAME arguments`` without,
and ends with CR. A reply is text with CRC and CR, or for BX binary: ``c4 a5``, length, CRC of these
four bytes, body, CRC of the body, all low byte first. CRC-16 with polynomial 0x8005 reflected,
start 0. Source: Polaris API Guide revision 5.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

COMMAND_END = b"\r"
BINARY_START = b"\xc4\xa5"
INVALID_COMMAND, WRONG_CRC, WRONG_MODE, NOT_INITIALISED = 0x01, 0x04, 0x0C, 0x10
INVALID_HANDLE, PARAMETERS = 0x08, 0x07


class CommandError(Exception):
    """A command that is answered by an error code."""

    def __init__(self, code: int) -> None:
        super().__init__(f"error {code:02X}")
        self.code = code


@dataclass(frozen=True)
class Command:
    """One command."""

    name: str
    arguments: str


def crc16(text: bytes) -> int:
    """CRC-16/ARC."""
    crc = 0
    for byte in text:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0xA001 if crc & 1 else crc >> 1
    return crc


def cut_commands(pending: bytes) -> tuple[list[bytes], bytes]:
    """Cut at carriage returns."""
    *lines, rest = pending.split(COMMAND_END)
    return [line for line in lines if line], rest


def read_command(line: bytes) -> Command:
    """Take a command apart and compare its CRC."""
    text = line.decode("ascii", "replace")
    name, colon, tail = text.partition(":")
    if not colon:
        name, _, arguments = text.partition(" ")
        return Command(name, arguments)
    arguments, digits = tail[:-4], tail[-4:]
    if digits != f"{crc16(f'{name}:{arguments}'.encode('ascii', 'replace')):04X}":
        raise CommandError(WRONG_CRC)
    return Command(name, arguments)


def text_reply(text: str) -> bytes:
    """Put a text reply on the wire."""
    body = text.encode()
    return body + f"{crc16(body):04X}".encode() + COMMAND_END


def binary_reply(body: bytes) -> bytes:
    """Put a binary reply on the wire."""
    head = BINARY_START + struct.pack("<H", len(body))
    return head + struct.pack("<H", crc16(head)) + body + struct.pack("<H", crc16(body))

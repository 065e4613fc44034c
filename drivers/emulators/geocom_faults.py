"""Faults of the station's serial line, switched by lines of JSON on standard input.

``{"fault": "late_reply", "delay_s": 0.6}``, ``{"fault": "silence"}``, ``{"fault": "cut_reply"}``,
``{"fault": "wrong_checksum"}``, ``{"fault": "noise"}``, ``{"fault": "code", "code": 1285}``; with
``"replies": n`` for the next n replies (default 1) and ``"rpc": n`` for that procedure only.
``{"fault": "wrong_id"}`` (another transaction's number), ``{"fault": "frozen"}`` (the reply before
once more), ``{"fault": "unplugged"}`` and ``{"fault": "plugged"}`` (the cable; needs a link),
``{"fault": "wrong_baud"}`` (another speed than before, until cleared).
``{"fault": "none"}`` clears. Each line is acknowledged by one line of JSON on standard output.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

CABLE_KINDS = ("unplugged", "plugged")
WRONG_BAUD = "wrong_baud"
KINDS = (
    "none",
    "late_reply",
    "silence",
    "cut_reply",
    "wrong_checksum",
    "wrong_id",
    "frozen",
    "noise",
    "code",
    *CABLE_KINDS,
    WRONG_BAUD,
)
NOISE = b"\xff\x00~R1P,,:\r\n"


@dataclass(frozen=True)
class Fault:
    """What goes wrong with the next replies."""

    fault: str = "none"
    delay_s: float = 0.0
    """How late a late reply is, real time [s]."""
    code: int = 0
    """Return code in place of the true one, the values being sent as if nothing had happened."""
    replies: int = 1
    rpc: int | None = None

    def __post_init__(self) -> None:
        """Refuse a fault that is not known."""
        if self.fault not in KINDS:
            raise ValueError(f"fault must be one of {', '.join(KINDS)}")

    def hits(self, procedure: int) -> bool:
        """Whether the reply to this procedure is spoilt."""
        spoils = self.fault not in {"none", WRONG_BAUD}
        return spoils and self.replies > 0 and self.rpc in {None, procedure}

    def used(self) -> Fault:
        """Return the fault with one reply less to spoil."""
        return replace(self, replies=self.replies - 1)

    def spoil(self, line: bytes, before: bytes) -> bytes:
        """Return the bytes that go out in place of `line`; `before` is the reply before it."""
        if self.fault == "frozen":
            return before
        if self.fault == "silence":
            return b""
        if self.fault == "cut_reply":
            return line[: len(line) // 2]
        if self.fault == "wrong_checksum":
            head, colon, tail = line.partition(b":")
            start, comma, checksum = head.rpartition(b",")
            return start + comma + str((int(checksum) + 1) % 65536).encode() + colon + tail
        if self.fault == "noise":
            return NOISE
        return line

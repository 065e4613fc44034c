"""Faults of a serial instrument, switched by lines of JSON on standard input.

``{"fault": "late_reply", "delay_s": 0.6}``, ``{"fault": "silence"}``, ``{"fault": "cut_reply"}``,
``{"fault": "noise"}``, ``{"fault": "frozen"}`` (the last reply once more), and where the
instrument's protocol has such a thing ``wrong_checksum``, ``wrong_id``, ``code`` (with ``"code"``:
an error code in place of the value). ``"replies": n`` spoils the next n replies, 1 by default.
``{"fault": "unplugged"}`` and ``{"fault": "plugged"}`` pull the cable and put it back;
``{"fault": "wrong_baud"}`` sets the instrument to another speed until ``{"fault": "none"}``, and
another speed than the instrument's garbles everything by itself. Each line is acknowledged by a
line.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

NOISE = b"\xff\x00~g#\x81,:\r\n"
WIRE_KINDS = ("none", "silence", "late_reply", "cut_reply", "noise", "frozen")
CABLE_KINDS = ("unplugged", "plugged", "wrong_baud")


@dataclass(frozen=True)
class Fault:
    """What goes wrong with the next replies."""

    fault: str = "none"
    delay_s: float = 0.0
    """How late a late reply is, real time [s]."""
    code: int = 0
    replies: int = 1

    @property
    def active(self) -> bool:
        """Whether the next reply is spoilt."""
        return self.fault != "none" and self.replies > 0

    def used(self) -> Fault:
        """Return the fault with one reply less to spoil."""
        return replace(self, replies=self.replies - 1)


Spoil = Callable[[bytes, Fault], bytes]
"""From a true reply to a wrong one."""


def spoilt(reply: bytes, before: bytes, fault: Fault, own: Mapping[str, Spoil]) -> bytes:
    """Return the bytes that go out in place of `reply`; `before` is the reply before this one."""
    match fault.fault:
        case "silence":
            return b""
        case "cut_reply":
            return reply[: len(reply) // 2]
        case "noise":
            return NOISE
        case "frozen":
            return before or reply
        case kind if kind in own:
            return own[kind](reply, fault)
        case _:
            return reply

"""Register layouts of the emulated Modbus controller, as the programs in the controllers know them.

Written down apart from the drivers' profiles on purpose: a wrong address in one of the two shows.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass


@dataclass(frozen=True)
class Layout:
    """Where the controller's program keeps its values. Joints take two registers each."""

    status_function: int
    """3: holding registers, 4: input registers."""
    low_word_first: bool
    turn: float
    """One count of a joint that turns [rad]."""
    slide: float
    """One count of a joint that slides [m]."""
    status: dict[str, tuple[int, int]]
    """Address and number of registers of each value that the controller writes."""
    status_joints: int
    orders: dict[str, tuple[int, int]]
    """The same of each value that the driver writes."""
    order_joints: int
    heartbeat: int
    safety: dict[str, int]
    """Codes of the world's safety words."""

    def words(self, value: int, count: int) -> list[int]:
        """Split a whole number into registers."""
        raw = (value % (1 << 16 * count)).to_bytes(2 * count, "big")
        words = list(struct.unpack(f">{count}H", raw))
        return words[::-1] if self.low_word_first else words

    def signed(self, words: list[int]) -> int:
        """Join two registers to a whole number with sign."""
        high, low = words[::-1] if self.low_word_first else words
        value = high << 16 | low
        return value - (1 << 32) if value >> 31 else value


LAYOUTS = {
    "generic": Layout(
        4,
        low_word_first=False,
        turn=1e-7,
        slide=1e-7,
        status={
            "check": (0, 2),
            "n_joints": (2, 1),
            "counter": (3, 1),
            "clock": (4, 2),
            "accepted": (6, 1),
            "done": (7, 1),
            "busy": (8, 1),
            "error": (9, 1),
            "safety": (10, 1),
        },
        status_joints=12,
        orders={
            "check": (100, 2),
            "sequence": (102, 1),
            "speed": (120, 2),
            "acceleration": (122, 2),
            "command": (124, 1),
        },
        order_joints=104,
        heartbeat=130,
        safety={
            "not_ready": 0,
            "normal": 1,
            "reduced": 2,
            "protective_stop": 3,
            "emergency_stop": 4,
            "safeguard_stop": 5,
            "fault": 6,
        },
    ),
    "staubli_cs9": Layout(
        3,
        low_word_first=True,
        turn=math.radians(1e-5),
        slide=1e-7,
        status={
            "check": (1000, 2),
            "n_joints": (1002, 1),
            "safety": (1003, 1),
            "accepted": (1004, 1),
            "done": (1005, 1),
            "busy": (1006, 1),
            "error": (1007, 1),
            "counter": (1008, 1),
            "clock": (1010, 2),
        },
        status_joints=1012,
        orders={
            "check": (1100, 2),
            "speed": (1114, 2),
            "acceleration": (1116, 2),
            "sequence": (1118, 1),
            "command": (1119, 1),
        },
        order_joints=1102,
        heartbeat=1120,
        safety={
            "not_ready": 0,
            "normal": 1,
            "reduced": 2,
            "safeguard_stop": 3,
            "protective_stop": 9,
            "emergency_stop": 4,
            "fault": 9,
        },
    ),
}

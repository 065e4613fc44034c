"""Values in registers of 16 bits."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass

from drivers.profile_file import Profile

FORMATS = {"uint16": "H", "int16": "h", "uint32": "I", "int32": "i", "float32": "f"}
"""Types by name, as `struct` letters."""
LAST_ADDRESS = 65535


@dataclass(frozen=True)
class Register:
    """Where a value stands and how it is written."""

    address: int
    kind: str
    big: bool
    """Whether the high word comes first."""

    @classmethod
    def read(cls, section: Profile, name: str, *kinds: str, big: bool) -> Register:
        """Read ``{address: 12, type: int32}`` from a profile."""
        entry = section.section(name)
        register = cls(
            entry.whole("address", 0, LAST_ADDRESS), entry.choice("type", *(kinds or FORMATS)), big
        )
        entry.end()
        return register

    @property
    def words(self) -> int:
        """Registers that one value takes."""
        return struct.calcsize(FORMATS[self.kind]) // 2

    def places(self, count: int = 1) -> range:
        """Addresses that `count` values one after the other take."""
        return range(self.address, self.address + count * self.words)

    def decode(self, block: Sequence[int], start: int, count: int = 1) -> tuple[float, ...]:
        """Take values out of registers that were read from address `start` on."""
        return tuple(
            self._decode_one(block[place - start : place - start + self.words])
            for place in self.places(count)[:: self.words]
        )

    def encode(self, value: float) -> list[int]:
        """Give the registers of one value.

        Raises
        ------
        OverflowError
            If the value does not fit.
        """
        letter = FORMATS[self.kind]
        try:
            raw = struct.pack(f">{letter}", value if letter == "f" else round(value))
        except struct.error as fault:
            raise OverflowError(f"{value:g} does not fit into {self.kind}") from fault
        words = struct.unpack(f">{self.words}H", raw)
        return list(words if self.big else words[::-1])

    def _decode_one(self, words: Sequence[int]) -> float:
        ordered = words if self.big else words[::-1]
        raw = struct.pack(f">{self.words}H", *ordered)
        (value,) = struct.unpack(f">{FORMATS[self.kind]}", raw)
        return float(value)

"""What a relayed line looks like: pattern, number, checksum, unit and axes, from a profile."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from drivers.devices.relay.axes import Axes, Quaternion
from drivers.profile_file import Profile, read_profile

UNITS = {"m": 1.0, "mm": 1e-3}
CHECKSUMS = ("none", "xor8", "sum8", "crc16_arc")
POINT = ("x", "y", "z")
TURN = ("qw", "qx", "qy", "qz")
NUMBER = "{number}"
UNIT_WITHIN = 1e-3
"""How far a quaternion's length may be from 1."""


class LineError(Exception):
    """A line that is no measurement; says why."""


@dataclass(frozen=True)
class Measurement:
    """What one line says, in SI and our axes."""

    number: int | None
    position: tuple[float, float, float]
    orientation: Quaternion | None


@dataclass(frozen=True)
class Complaint:
    """A line by which the host says that it could not measure."""

    number: int | None
    code: str
    advice: str


@dataclass(frozen=True)
class LineProfile:
    """A profile of the kind `relay`."""

    baud: int
    serial: str
    trigger: str | None
    """What to send for each measurement; None where lines come by themselves."""
    line: re.Pattern[str]
    error_line: re.Pattern[str] | None
    errors: dict[str, str]
    checksum: str
    metres: float
    axes: Axes

    @classmethod
    def read(cls, device: str, name: str) -> LineProfile:
        """Read and check a profile.

        Raises
        ------
        Refused
            If a field is wrong, or the lines could not be told from old ones.
        """
        profile = read_profile(device, name)
        profile.choice("kind", "relay")
        made = cls(
            profile.whole("baud", 300, 4_000_000),
            profile.word("serial"),
            profile.word("trigger") if profile.has("trigger") else None,
            _pattern(profile, "line"),
            _pattern(profile, "error_line") if profile.has("error_line") else None,
            profile.words_by_name("errors") if profile.has("errors") else {},
            profile.choice("checksum", *CHECKSUMS),
            UNITS[profile.choice("position_unit", *UNITS)],
            _axes(profile),
        )
        profile.end()
        made._check(profile)
        return made

    def understand(self, raw: bytes) -> Measurement | Complaint:
        """Take one line apart.

        Raises
        ------
        LineError
            If it is of another form, its checksum is wrong, or its numbers make no pose.
        """
        text = raw.decode("ascii", "replace")
        found = self.line.fullmatch(text)
        complaint = None
        if found is None and self.error_line is not None:
            found = complaint = self.error_line.fullmatch(text)
        if found is None:
            raise LineError("the line is of another form than the profile says")
        self._compare_checksum(found)
        groups = found.groupdict()
        number = int(groups["number"]) if groups.get("number") else None
        if complaint is not None:
            code = groups["code"]
            advice = self.errors.get(code, "look it up in the program of the tracker's host")
            return Complaint(number, code, advice)
        return Measurement(number, self._position(groups), self._orientation(groups))

    def _position(self, groups: dict[str, str]) -> tuple[float, float, float]:
        return self.axes.point([_float(groups[name]) * self.metres for name in POINT])

    def _orientation(self, groups: dict[str, str]) -> Quaternion | None:
        if "qw" not in groups:
            return None
        w, x, y, z = (_float(groups[name]) for name in TURN)
        length = math.hypot(w, x, y, z)
        if abs(length - 1.0) > UNIT_WITHIN:
            raise LineError(f"the quaternion's length is {length:.4f} and not 1")
        return self.axes.orientation((w / length, x / length, y / length, z / length))

    def _compare_checksum(self, found: re.Match[str]) -> None:
        if self.checksum == "none":
            return
        stated, computed = int(found["checksum"], 16), _sum(self.checksum, found["body"].encode())
        if stated != computed:
            raise LineError(f"its checksum is {stated:X} and its bytes make {computed:X}")

    def _check(self, profile: Profile) -> None:
        groups = set(self.line.groupindex)
        if not groups.issuperset(POINT) or (groups & set(TURN) and not groups.issuperset(TURN)):
            raise profile.wrong("line", "must have the groups x, y, z, and all of qw … qz or none")
        checked = {"body", "checksum"}
        patterns = [self.line, *([self.error_line] if self.error_line else [])]
        for pattern in patterns:
            if self.checksum != "none" and not checked <= set(pattern.groupindex):
                raise profile.wrong("checksum", "needs the groups body and checksum in every line")
        if self.error_line is not None and "code" not in self.error_line.groupindex:
            raise profile.wrong("error_line", "must have the group code")
        if (self.trigger is None or NUMBER in self.trigger) and "number" not in groups:
            raise profile.wrong(
                "line",
                "must have the group number: without it an old line is not told from a new one",
            )
        if self.axes.mirrors and groups.issuperset(TURN):
            raise profile.wrong(
                "axes", "are left-handed, and orientations of such axes are not understood"
            )


def _pattern(profile: Profile, name: str) -> re.Pattern[str]:
    try:
        return re.compile(profile.word(name))
    except re.error as fault:
        raise profile.wrong(name, f"is no regular expression ({fault})") from fault


def _axes(profile: Profile) -> Axes:
    names = profile.words("axes")
    try:
        return Axes(names)
    except ValueError as fault:
        raise profile.wrong("axes", f"is wrong: {fault}") from fault


def _float(text: str) -> float:
    try:
        number = float(text)
    except ValueError as fault:
        raise LineError(f"{text!r} is no number") from fault
    if not math.isfinite(number):
        raise LineError(f"{text!r} is no finite number")
    return number


def _sum(kind: str, body: bytes) -> int:
    if kind == "sum8":
        return sum(body) & 0xFF
    total = 0
    for byte in body:
        total ^= byte
        if kind == "crc16_arc":
            for _ in range(8):
                total = (total >> 1) ^ 0xA001 if total & 1 else total >> 1
    return total

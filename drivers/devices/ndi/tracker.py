"""NDI position sensor (Polaris, Vicra, Spectra) over a serial line: position and orientation.

The frame is the sensor's own; each shot is another frame of it, told by the frame number, so that
an old one is never taken twice. `ndicapi` keeps the bytes of a garbled reply to itself, so errors
carry none. Never tried on an instrument. Source: Polaris API Guide revision 5.
"""

from __future__ import annotations

import math
import statistics
import time

from drivers.addresses import Address
from drivers.devices.ndi.session import NO_ROM, Session
from drivers.errors import BadReply, NoReply, Unreachable
from drivers.interfaces import TrackerReading
from drivers.transport import read_again

SHOTS = 10
CONNECT_DEADLINE_S = 8.0
SHOT_DEADLINE_S = 0.3
REPLY_DEADLINE_S = 0.7
MM = 1e-3
"""[m]"""
UNIT_WITHIN = 1e-3
"""How far a quaternion's length may be from 1."""

Pose = tuple[tuple[float, float, float], tuple[float, float, float, float]]


class NdiTracker:
    """A position sensor at a serial port.

    Parameters
    ----------
    address
        Name of the serial port; options `tool` (1), the number of the tool among those plugged in,
        and `rom`, the tool file of a passive tool.
    shots
        Frames that one reading averages.
    connect_deadline_s
        For starting the child and some ten exchanges at 9600 baud [s].
    """

    def __init__(
        self, address: str, *, shots: int = SHOTS, connect_deadline_s: float = CONNECT_DEADLINE_S
    ) -> None:
        if shots < 1:
            raise ValueError(f"shots must be at least 1, not {shots}")
        self._device = f"tracker ndi at {address}"
        where = Address(self._device, address, "tool", "rom")
        self._arguments = (where.place, str(where.whole("tool", 1)), where.word("rom", NO_ROM))
        self._shots = shots
        self._connect_deadline_s = connect_deadline_s
        self._session: Session | None = None
        self._wanted = False

    @property
    def child_pid(self) -> int | None:
        """Process number of the child, None while there is none."""
        return None if self._session is None else self._session.pid

    def connect(self) -> None:
        """Start the child, which initialises the sensor, enables the tool and starts tracking.

        Raises
        ------
        Unreachable, NoReply, BadReply
            The port does not open, or no sensor answers there.
        Refused
            There is no such tool, or the sensor declines a command.
        """
        self.close()
        self._wanted = True
        self._open_session()

    def measure(self) -> TrackerReading:
        """Read the tool in several frames and average them.

        Raises
        ------
        Refused
            The tool is missing or disabled, or the sensor declines with its error code.
        NoReply, BadReply, Unreachable
            The line fails or the frames stand still.
        """
        poses = read_again(self._measure)
        centre, turn = _mean(poses)
        spread = 0.0
        if len(poses) > 1:
            axes = zip(*(position for position, _ in poses), strict=True)
            spread = max(statistics.stdev(axis) for axis in axes)
        return TrackerReading(centre, turn, spread, len(poses), time.monotonic())

    def close(self) -> None:
        """End the child."""
        self._wanted = False
        self._drop()

    def _measure(self) -> list[Pose]:
        session = self._open_session()
        try:
            shots = session.shots(self._shots, REPLY_DEADLINE_S + self._shots * SHOT_DEADLINE_S)
        except (NoReply, BadReply, Unreachable):
            # A new child finds the sensor again and has no old reply on its line.
            self._drop()
            raise
        return [self._pose(shot) for shot in shots]

    def _pose(self, shot: list[float]) -> Pose:
        w, x, y, z, tx, ty, tz = shot
        length = math.hypot(w, x, y, z)
        if not all(map(math.isfinite, shot)) or abs(length - 1.0) > UNIT_WITHIN:
            raise BadReply(
                self._device, "BX", f"{shot} is no pose; check the tool's file and its markers"
            )
        return (tx * MM, ty * MM, tz * MM), (w / length, x / length, y / length, z / length)

    def _open_session(self) -> Session:
        if not self._wanted:
            raise Unreachable(self._device, "BX", "not connected; call connect first")
        if self._session is None:
            self._session = Session(self._device, self._arguments, self._connect_deadline_s)
        return self._session

    def _drop(self) -> None:
        if self._session is not None:
            self._session.end()
            self._session = None


def _mean(poses: list[Pose]) -> Pose:
    """Average poses that differ by noise: quaternions summed on one side and made unit."""
    x, y, z = (statistics.fmean(axis) for axis in zip(*(p for p, _ in poses), strict=True))
    first = poses[0][1]
    total = [0.0] * 4
    for _, turn in poses:
        side = 1.0 if sum(a * b for a, b in zip(turn, first, strict=True)) >= 0.0 else -1.0
        total = [a + side * b for a, b in zip(total, turn, strict=True)]
    length = math.hypot(*total)
    qw, qx, qy, qz = (number / length for number in total)
    return (x, y, z), (qw, qx, qy, qz)

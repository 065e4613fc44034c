"""Total station over a serial line, speaking GeoCOM through the `geocompy` library.

Position only. East, north, height of the station's own frame are x, y, z; the horizontal circle
counts clockwise from north, the vertical one from the zenith. A shot is BAP_MeasDistanceAngle (RPC
17017) and not TMC_DoMeasure with TMC_GetCoordinate: it is one exchange instead of two, cannot
return the values of an earlier measurement, and gives raw angles and slope distance with all
digits, free of the station coordinates, scale and reductions that a surveyor may have set.

`geocompy` raises nothing: whatever is not return code 0 becomes a typed error here, also the
codes that come with values (1283 to 1285). Nothing here was tried on a real instrument.

Source: Leica GeoCOM Reference Manual TPS1200/TS30/TM30 v1.50.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self, SupportsIndex, TypeVar

from geocompy.geo import GeoCom
from geocompy.geo.gctypes import GeoComCode, GeoComResponse
from serial import Serial, SerialException

from drivers.addresses import Address
from drivers.devices.geocom.codes import LOST, SUSPECT, advice_on
from drivers.devices.geocom.line import REPLY, TransactionLine
from drivers.errors import BadReply, DriverError, NoReply, Refused, Unreachable
from drivers.interfaces import FixedNest, TrackerReading
from drivers.transport import open_serial, read_again

T = TypeVar("T")

REPLY_TIMEOUT_S = 2.0
"""Longest wait for an answer that takes no measurement [s]."""
MEASURE_TIMEOUT_S = 12.0
"""Longest wait for a search or a distance [s]; the manual's worst case is 10 s."""
SHOTS = 3
SEARCH_WINDOW = 0.2
"""Side of the window that is searched for the target around where the telescope points [rad]."""
BAUD = 115200
QUIET_S = 0.2
"""A line silent for this long has nothing left to deliver [s]."""
DIGITS = 15
"""Decimals that the station is told to send; fewer than 9 would cost micrometres."""


@dataclass(frozen=True)
class Atmosphere:
    """What light travels through."""

    pressure_hpa: float
    dry_degc: float
    wet_degc: float


class _ManyDigits(float):
    """A number that `geocompy` sends whole; of others it sends six decimals."""

    def __round__(self, digits: SupportsIndex | None = None) -> Self:  # type: ignore[override]
        del digits
        return self

    def __format__(self, form: str) -> str:
        del form
        return format(float(self), ".15f")


class GeoComTracker:
    """A total station at a serial port, ``/dev/ttyUSB0`` or ``COM4``.

    Parameters
    ----------
    address
        Name of the serial port; option `baud`.
    shots
        Distance measurements that one reading averages.
    baud
        Speed that is set at the station.
    search_window
        Side of the window that is searched for the target [rad].
    reply_timeout_s, measure_timeout_s
        Longest waits for an answer without and with a measurement [s].
    """

    def __init__(
        self,
        address: str,
        *,
        shots: int = SHOTS,
        baud: int = BAUD,
        search_window: float = SEARCH_WINDOW,
        reply_timeout_s: float = REPLY_TIMEOUT_S,
        measure_timeout_s: float = MEASURE_TIMEOUT_S,
    ) -> None:
        if shots < 1:
            raise ValueError(f"shots must be at least 1, not {shots}")
        self._device = f"tracker geocom at {address}"
        where = Address(self._device, address, "baud")
        self._address = where.place
        self._shots = shots
        self._baud = where.whole("baud", baud)
        self._search_window = search_window
        self._reply_timeout_s = reply_timeout_s
        self._measure_timeout_s = measure_timeout_s
        self._port: Serial | None = None
        self._station: GeoCom | None = None

    def connect(self) -> None:
        """Open the port, find a GeoCOM station there, and switch its target recognition on.

        Raises
        ------
        Unreachable
            If the port does not open.
        NoReply
            If nothing there speaks GeoCOM.
        Refused
            If the station has no target recognition.
        """
        self.close()
        self._port = open_serial(self._device, self._address, self._baud, self._reply_timeout_s)
        try:
            self._drain(self._port)
            self._station = GeoCom(TransactionLine(self._port), checksum=True)
        except SerialException as fault:
            raise self._gone("connect") from fault
        except ConnectionRefusedError as fault:
            self.close()
            raise NoReply(
                self._device,
                "COM_NullProc",
                "nothing there speaks GeoCOM; check that the station is on, that its interface is "
                f"set to GeoCOM with {self._baud} baud, and the cable",
            ) from fault
        if self._station.precision < DIGITS:
            self._ask("COM_SetDoublePrecision", lambda s: s.com.set_double_precision(DIGITS))
        self._ask("AUS_SetUserAtrState", lambda s: s.aus.switch_user_atr(True))  # noqa: FBT003

    def measure(self) -> TrackerReading:
        """Aim at the target and average several shots; a missing or garbled reply is asked again.

        Raises
        ------
        Refused
            If the station declined or gave values that it does not vouch for (codes 1283 to 1285
            and the like); the reason says what to do.
        NoReply, BadReply, Unreachable
            If the line fails.
        """
        read_again(self._aim)
        points = [self._shoot() for _ in range(self._shots)]
        x, y, z = (statistics.fmean(axis) for axis in zip(*points, strict=True))
        spread = 0.0
        if len(points) > 1:
            spread = max(statistics.stdev(axis) for axis in zip(*points, strict=True))
        return TrackerReading((x, y, z), None, spread, len(points), time.monotonic())

    def measure_fixed(self, nest: FixedNest) -> TrackerReading:
        """Turn to a fixed nest, measure it, and turn back; raises as `measure` does."""
        horizontal, vertical = self._direction()
        x, y, z = nest.position
        self._turn(math.atan2(x, y) % math.tau, math.atan2(math.hypot(x, y), z))
        try:
            return self.measure()
        finally:
            self._turn(horizontal, vertical)

    def atmosphere(self) -> Atmosphere:
        """Read the air that was entered at the station (TMC_GetAtmCorr)."""
        _, pressure, dry, wet = self._values(
            "TMC_GetAtmCorr", lambda s: s.tmc.get_atmospheric_corrections()
        )
        return Atmosphere(pressure, dry, wet)

    def set_atmosphere(self, air: Atmosphere) -> None:
        """Enter the air at the station (TMC_SetAtmCorr), which corrects distances for it.

        The wavelength of the light belongs to the station and is written back as it was read.

        Raises
        ------
        Refused
            If the station did not keep what was entered.
        """
        command = "TMC_GetAtmCorr"
        wavelength = self._values(command, lambda s: s.tmc.get_atmospheric_corrections())[0]
        entered = (_ManyDigits(wavelength), air.pressure_hpa, air.dry_degc, air.wet_degc)
        self._ask("TMC_SetAtmCorr", lambda s: s.request(2028, entered))
        kept = self._values(command, lambda s: s.tmc.get_atmospheric_corrections())
        if any(abs(a - b) > 1e-9 for a, b in zip(kept, entered, strict=True)):
            raise Refused(
                self._device,
                "TMC_SetAtmCorr",
                f"the station was told {entered} and keeps {kept}; enter the air at the station",
            )

    def set_atmospheric_ppm(self, ppm: float) -> None:
        """Tell the station by how much to correct distances for the atmosphere (TMC_SetAtmPpm)."""
        self._ask("TMC_SetAtmPpm", lambda s: s.tmc.set_atmospheric_correction_ppm(ppm))

    def atmospheric_ppm(self) -> float:
        """Read by how much the station corrects distances for the atmosphere (TMC_GetAtmPpm)."""
        return self._values("TMC_GetAtmPpm", lambda s: s.tmc.get_atmospheric_correction_ppm())

    def close(self) -> None:
        """Close the port if open."""
        if self._port is not None:
            self._port.close()
        self._port = self._station = None

    def _direction(self) -> tuple[float, float]:
        """Where the telescope looks: horizontal and zenith angle [rad] (TMC_GetAngle5)."""
        horizontal, vertical = self._values("TMC_GetAngle5", lambda s: s.tmc.get_angle())
        return float(horizontal), float(vertical)

    def _turn(self, horizontal: float, vertical: float) -> None:
        """Turn the telescope (AUT_MakePositioning); turning to the same place twice is harmless."""
        read_again(
            lambda: self._ask(
                "AUT_MakePositioning",
                lambda s: s.aut.turn_to(horizontal, vertical),
                self._measure_timeout_s,
            )
        )

    def _aim(self) -> None:
        window = self._search_window
        self._ask(
            "AUT_FineAdjust", lambda s: s.aut.fine_adjust(window, window), self._measure_timeout_s
        )

    def _shoot(self) -> tuple[float, float, float]:
        horizontal, vertical, slope, _ = self._values(
            "BAP_MeasDistanceAngle",
            lambda s: s.bap.measure_distance_angle(),
            self._measure_timeout_s,
        )
        across = float(slope) * math.sin(vertical)
        return (
            across * math.sin(horizontal),
            across * math.cos(horizontal),
            float(slope) * math.cos(vertical),
        )

    def _values(
        self,
        command: str,
        call: Callable[[GeoCom], GeoComResponse[T]],
        timeout_s: float | None = None,
    ) -> T:
        """Read values, again after a missing or garbled reply."""

        def read() -> T:
            reply = self._ask(command, call, timeout_s)
            if reply.params is None:
                raise BadReply(self._device, command, "no values", reply.response.encode())
            return reply.params

        return read_again(read)

    def _ask(
        self,
        command: str,
        call: Callable[[GeoCom], GeoComResponse[T]],
        timeout_s: float | None = None,
    ) -> GeoComResponse[T]:
        """Call one procedure and turn every code but 0 into an error."""
        if self._port is None or self._station is None:
            raise Unreachable(self._device, command, "not connected; call connect first")
        try:
            self._port.timeout = timeout_s or self._reply_timeout_s
            reply = call(self._station)
            if reply.error in SUSPECT:
                self._drain(self._port)
        except SerialException as fault:
            raise self._gone(command) from fault
        if reply.error is GeoComCode.OK:
            return reply
        raise self._error(command, reply)

    def _gone(self, command: str) -> Unreachable:
        self.close()
        return Unreachable(
            self._device, command, "the serial line is gone; check the cable and connect again"
        )

    def _error(self, command: str, reply: GeoComResponse[Any]) -> DriverError:
        raw = reply.response.encode()
        if reply.error in LOST:
            return self._gone(command)
        if reply.error is GeoComCode.COM_TIMEDOUT:
            return NoReply(self._device, command, "no reply in time; check that the station is on")
        if reply.error in SUSPECT:
            return BadReply(self._device, command, "the reply is garbled; check the cable", raw)
        found = REPLY.match(reply.response)
        code = "?" if found is None else found[3] if found[1] == "0" else found[1]
        advice = advice_on(reply.error)
        return Refused(self._device, command, f"code {code} {reply.error.name}: {advice}", raw)

    def _drain(self, port: Serial) -> None:
        """Read until the line is quiet, then forget everything that is still buffered.

        Resetting the buffers alone does not help while a late reply is still on its way.
        """
        port.timeout = QUIET_S
        end = time.monotonic() + self._measure_timeout_s
        while port.read(4096) and time.monotonic() < end:
            pass
        port.reset_input_buffer()
        port.reset_output_buffer()

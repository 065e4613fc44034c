"""The total station behind the wire: GeoCOM procedures that look at the world's target.

East, north, height are the world's x, y, z; the horizontal circle counts clockwise from north,
the vertical one from the zenith. The station's only own error is the rounding of its replies, to
1e-15 rad and 1e-9 m. Source: Leica GeoCOM Reference Manual TPS1200/TS30/TM30 v1.50.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from drivers.emulators.geocom_wire import NO_SUCH_PROCEDURE, OK, Reply, Request
from drivers.emulators.world_link import WorldLink

INVALID_PARAMETER = 2
ANGLE_OK = 1285
NO_TARGET = 8710

POINTED_WITHIN = 0.03
"""A telescope turned nearer than this to a fixed nest sees that nest and not the robot [rad]."""
MEASURING_S = 0.3
"""World time of one distance measurement [s]."""
AIMING_S = 0.5
"""World time of one fine adjustment by the camera [s]."""
DISTANCE_DIGITS = 9
CLEAR_DISTANCE = "3"


@dataclass(frozen=True)
class Sighting:
    """Where the target was seen."""

    east: float
    north: float
    height: float
    """[m]"""
    time_ms: int

    def polar(self) -> tuple[float, float, float]:
        """Horizontal angle, zenith angle [rad], slope distance [m]."""
        slope = math.sqrt(self.east**2 + self.north**2 + self.height**2)
        horizontal = math.atan2(self.east, self.north) % (2 * math.pi)
        return horizontal, math.acos(self.height / slope), slope


class Station:
    """The instrument behind the wire."""

    def __init__(self, world: WorldLink) -> None:
        self._world = world
        self._digits = 15
        self._last: Sighting | None = None
        self._nest: str | None = None
        self._pointing = (0.0, math.pi / 2)
        self._atmosphere = ("0.000000658", "1013.25", "20.0", "15.0")
        self._ppm = "0.0"
        self._procedures: dict[int, Callable[[Request], Awaitable[Reply]]] = {
            2008: self._do_measure,
            2028: self._set_atmosphere,
            2029: self._get_atmosphere,
            2148: self._set_ppm,
            2151: self._get_ppm,
            2082: self._get_coordinate,
            2107: self._get_angle,
            9027: self._turn_telescope,
            9037: self._fine_adjust,
            17017: self._measure_distance_angle,
            107: self._set_digits,
            108: self._get_digits,
        }
        self._constants: dict[int, tuple[str, ...]] = {
            0: (),
            110: ("1", "50", "0"),
            5003: ("365123",),
            5004: ('"TS30"',),
            5034: ("5", "60", "0"),
            18005: (),
        }

    async def answer(self, request: Request) -> tuple[int, Reply]:
        """Run a procedure; give the communication code and the reply."""
        if request.procedure in self._constants:
            return OK, Reply(OK, self._constants[request.procedure])
        if request.procedure not in self._procedures:
            return NO_SUCH_PROCEDURE, Reply(OK)
        return OK, await self._procedures[request.procedure](request)

    async def _sight(self, world_seconds: float) -> Sighting | None:
        """Look at the target for a while; None if there is nothing to see at the end."""
        hello = await self._world.ask("hello")
        await asyncio.sleep(world_seconds / hello["time_scale"])
        target = {} if self._nest is None else {"target": self._nest}
        reading = await self._world.ask("measure", **target)
        if not reading["ok"]:
            return None
        east, north, height = reading["position"]
        seen = Sighting(east, north, height, int(reading["time_s"] * 1e3))
        self._pointing = seen.polar()[:2]
        return seen

    def _number(self, value: float, digits: int) -> str:
        return f"{value:.{min(digits, self._digits)}f}"

    async def _measure_distance_angle(self, request: Request) -> Reply:
        if request.parameters != ("2",):
            return Reply(INVALID_PARAMETER)
        self._last = await self._sight(MEASURING_S)
        if self._last is None:
            return Reply(NO_TARGET)
        horizontal, vertical, slope = self._last.polar()
        angles = (self._number(angle, self._digits) for angle in (horizontal, vertical))
        return Reply(OK, (*angles, self._number(slope, DISTANCE_DIGITS), "2"))

    async def _do_measure(self, request: Request) -> Reply:
        """TMC_DoMeasure answers at once; what it saw is fetched by TMC_GetCoordinate."""
        if len(request.parameters) != 2:
            return Reply(INVALID_PARAMETER)
        self._last = None
        if request.parameters[0] != CLEAR_DISTANCE:
            self._last = await self._sight(MEASURING_S)
        return Reply(OK)

    async def _get_coordinate(self, request: Request) -> Reply:
        if len(request.parameters) != 2:
            return Reply(INVALID_PARAMETER)
        if self._last is None:
            return Reply(ANGLE_OK, ("0.0", "0.0", "0.0", "0", "0.0", "0.0", "0.0", "0"))
        seen = self._last
        point = [self._number(v, DISTANCE_DIGITS) for v in (seen.east, seen.north, seen.height)]
        point.append(str(seen.time_ms))
        return Reply(OK, (*point, *point))

    async def _fine_adjust(self, request: Request) -> Reply:
        if len(request.parameters) != 3:
            return Reply(INVALID_PARAMETER)
        seen = await self._sight(AIMING_S)
        return Reply(OK if seen else NO_TARGET)

    async def _turn_telescope(self, request: Request) -> Reply:
        """Look elsewhere: at a fixed nest where one stands there, else after the robot's target."""
        if len(request.parameters) != 5:
            return Reply(INVALID_PARAMETER)
        horizontal, vertical = (float(angle) for angle in request.parameters[:2])
        self._pointing = (horizontal % (2 * math.pi), vertical)
        there = await self._world.ask("nests")
        self._nest = None
        for name, (east, north, height) in there["nests"].items():
            across, up, _ = Sighting(east, north, height, 0).polar()
            turned = (across - horizontal + math.pi) % (2 * math.pi) - math.pi
            if math.hypot(turned * math.sin(up), up - vertical) < POINTED_WITHIN:
                self._nest = name
        return Reply(OK)

    async def _get_angle(self, request: Request) -> Reply:
        if len(request.parameters) != 1:
            return Reply(INVALID_PARAMETER)
        return Reply(OK, tuple(self._number(angle, self._digits) for angle in self._pointing))

    async def _set_atmosphere(self, request: Request) -> Reply:
        if len(request.parameters) != 4:
            return Reply(INVALID_PARAMETER)
        wavelength, pressure, dry, wet = request.parameters
        self._atmosphere = (wavelength, pressure, dry, wet)
        return Reply(OK)

    async def _get_atmosphere(self, request: Request) -> Reply:
        del request
        return Reply(OK, self._atmosphere)

    async def _set_ppm(self, request: Request) -> Reply:
        if len(request.parameters) != 1:
            return Reply(INVALID_PARAMETER)
        self._ppm = request.parameters[0]
        return Reply(OK)

    async def _get_ppm(self, request: Request) -> Reply:
        del request
        return Reply(OK, (self._ppm,))

    async def _set_digits(self, request: Request) -> Reply:
        if len(request.parameters) != 1 or not 0 <= int(request.parameters[0]) <= 15:
            return Reply(INVALID_PARAMETER)
        self._digits = int(request.parameters[0])
        return Reply(OK)

    async def _get_digits(self, request: Request) -> Reply:
        del request
        return Reply(OK, (str(self._digits),))

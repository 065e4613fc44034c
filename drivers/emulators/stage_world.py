"""The emulated sensing stage between two robots, started as its own process.

``python -m drivers.emulators.stage_world --config FILE.json [--port 0]`` prints one line
``{"ready": true, "port": N}`` and ends when its standard input closes. It holds both robots'
worlds. One JSON object a line over TCP, as in `world`; the serial instruments are started with this
address as their world. Operations:

- ``stage``: one sensor's reading (`slide`, `rod_angle`, `rod_length`) at the stage's present state.
- ``touch``: a person sets the stage and leads `robot`'s needle into `cup`; `slide_mm`,
  `rod_angle_deg`, `rod_length_mm` say about where, `slip_mm` how far beside the cup it sits.
- ``shake``: `amplitude` [m, rad] by which a `sensor` wavers, 0 for none.
- ``faults``: put other hidden faults in place. ``truth``: open the sealed truth.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import math
import sys
import time
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from drivers.emulators.process import report_ready, until_stdin_closes
from drivers.emulators.records import WorldError, build
from drivers.emulators.rigid import Frame
from drivers.emulators.stage_geometry import (
    CUPS,
    SENSORS,
    SensorNoise,
    StageConfig,
    StageFaults,
    cup_place,
    shown,
)
from drivers.emulators.stage_robot import StageRobot

Request = Mapping[str, Any]
Reply = dict[str, Any]
DIALS = ("slide_mm", "rod_angle_deg", "rod_length_mm")
CARELESS = (2e-3, 5e-3, 2e-3)
"""How far from the numbers asked for a person sets the stage at most [m, rad, m]"""
SHAKING_HZ = 3.0


class StageWorld:
    """The stage with a robot's needle in one of its cups, or none."""

    def __init__(self, config: StageConfig, robots: dict[str, StageRobot]) -> None:
        self._config = config
        self._robots = robots
        self._rng = np.random.default_rng(config.seed)
        self._stage = config.stage.matrix()
        self._bases = {"master": np.eye(4), "slave": config.slave_base.matrix()}
        self._faults = config.faults
        self._set = (0.0, 0.0, 300.0)
        """Numbers that were asked for last, as in `DIALS`"""
        self._true = (0.0, 0.0, 0.3)
        self._error = np.zeros(3)
        self._shaking = dict.fromkeys(SENSORS, 0.0)
        self._begin = time.monotonic()
        self._last: Reply = {}

    async def stage(self, request: Request) -> Reply:
        """Read one sensor."""
        sensor = request["sensor"]
        if sensor not in SENSORS:
            raise WorldError("no_sensor", f"No stage sensor {sensor!r}, there are {SENSORS}.")
        number = SENSORS.index(sensor)
        noise = self._config.noise
        sigma = noise.reading_mrad if sensor == "rod_angle" else noise.reading_mm
        phase = math.tau * SHAKING_HZ * (time.monotonic() - self._begin)
        value = shown(self._faults, *self._true)[sensor] + self._error[number]
        value += self._shaking[sensor] * math.sin(phase) + self._rng.normal(0.0, sigma * 1e-3)
        return {"value": float(value)}

    async def touch(self, request: Request) -> Reply:
        """Set the stage and lead a needle into a cup."""
        robot, cup = request["robot"], request["cup"]
        if robot not in self._robots or cup not in CUPS:
            raise WorldError("bad_request", "robot must be master or slave, cup slide or rod.")
        dials = tuple(float(request.get(name, held)) for name, held in self._dials())
        self._turn_to(dials)
        seat = self._rng.normal(0.0, self._config.seat_mm * 1e-3, 3)
        slip = np.array(request.get("slip_mm", (0.0, 0.0, 0.0)), dtype=float) * 1e-3
        place = cup_place(self._faults, self._stage, cup, *self._true) + seat + slip
        base = self._bases[robot]
        joints = await self._robots[robot].lead(base[:3, :3].T @ (place - base[:3, 3]))
        self._last = {"robot": robot, "cup": cup, "place": place.tolist(), "joints": joints}
        return self._last

    async def shake(self, request: Request) -> Reply:
        """Let a sensor waver."""
        if request["sensor"] not in SENSORS:
            raise WorldError("no_sensor", f"sensor must be one of {', '.join(SENSORS)}.")
        self._shaking[request["sensor"]] = float(request["amplitude"])
        return {}

    async def set_faults(self, request: Request) -> Reply:
        """Put other hidden faults in place."""
        self._faults = build(StageFaults, request["faults"], "faults")
        return {}

    async def truth(self, request: Request) -> Reply:
        """Open the sealed truth."""
        del request
        needles = {name: (await robot.needle()).tolist() for name, robot in self._robots.items()}
        return {
            "slave_base": asdict(self._config.slave_base),
            "stage": asdict(self._config.stage),
            "faults": asdict(self._faults),
            "state": dict(zip(SENSORS, self._true, strict=True)),
            "needles": needles,
            "last": self._last,
        }

    def _dials(self) -> list[tuple[str, float]]:
        return list(zip(DIALS, self._set, strict=True))

    def _turn_to(self, dials: tuple[float, ...]) -> None:
        """Set what is to be changed; a part that stays clamped keeps its error."""
        wanted = (dials[0] * 1e-3, math.radians(dials[1]), dials[2] * 1e-3)
        noise = self._config.noise
        sigma = (noise.setting_mm, noise.setting_mrad, noise.setting_mm)
        true = list(self._true)
        for part in range(3):
            if dials[part] != self._set[part] or not self._last:
                careless = CARELESS[part] * self._rng.uniform(-1.0, 1.0)
                true[part] = wanted[part] + careless
                self._error[part] = self._rng.normal(0.0, sigma[part] * 1e-3)
        self._true = (true[0], true[1], true[2])
        self._set = (dials[0], dials[1], dials[2])


def operation_of(world: StageWorld, request: Request) -> Callable[[Request], Awaitable[Reply]]:
    """Find the operation that a request names."""
    operations = {
        "stage": world.stage,
        "touch": world.touch,
        "shake": world.shake,
        "faults": world.set_faults,
        "truth": world.truth,
    }
    if request.get("op") not in operations:
        raise WorldError("bad_request", f"op must be one of {', '.join(operations)}.")
    return operations[request["op"]]


async def answer(world: StageWorld, line: bytes, began_s: float) -> Reply:
    """Follow one request; what cannot be followed is answered, the world goes on."""
    try:
        request = json.loads(line)
        reply = await operation_of(world, request)(request)
    except WorldError as refusal:
        return {"ok": False, "error": refusal.word, "message": str(refusal)}
    except (AttributeError, KeyError, TypeError, ValueError) as fault:
        return {"ok": False, "error": "bad_request", "message": f"{type(fault).__name__}: {fault}"}
    return {"ok": True, "time_s": time.monotonic() - began_s, **reply}


async def serve(config: StageConfig, port: int) -> None:
    """Answer any number of clients until standard input closes."""
    robots = {
        name: await StageRobot.meet(name, address, config.seed)
        for name, address in (("master", config.master), ("slave", config.slave))
    }
    world = StageWorld(config, robots)
    began_s = time.monotonic()

    async def converse(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while line := await reader.readline():
                writer.write(json.dumps(await answer(world, line, began_s)).encode() + b"\n")
                await writer.drain()
        except (ConnectionError, asyncio.CancelledError):
            return  # A client or a robot's world has gone.
        finally:
            writer.close()

    server = await asyncio.start_server(converse, "127.0.0.1", port)
    report_ready(port=server.sockets[0].getsockname()[1])
    await until_stdin_closes()
    server.close()


def read_config(path: Path) -> StageConfig:
    """Read a configuration file; a field that it does not know is an error."""
    entries = json.loads(path.read_text())
    sections = {"stage": Frame, "slave_base": Frame, "faults": StageFaults, "noise": SensorNoise}
    for name, section in sections.items():
        if name in entries:
            entries[name] = build(section, entries[name], f"{path.name}: {name}")
    return build(StageConfig, entries, path.name)


def main() -> int:
    """Run the stage of a configuration file."""
    parser = argparse.ArgumentParser(description="The emulated sensing stage between two robots.")
    parser.add_argument("--config", type=Path, required=True, help="configuration, JSON")
    parser.add_argument("--port", type=int, default=0, help="TCP port, 0 for a free one")
    options = parser.parse_args()
    try:
        asyncio.run(serve(read_config(options.config), options.port))
    except WorldError as fault:
        sys.stderr.write(f"{fault}\n")
        return 2
    except ConnectionError as fault:
        sys.stderr.write(f"{fault}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

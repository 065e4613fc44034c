"""The emulated world: one true cell behind a socket, started as its own process.

``python -m drivers.emulators.world --config FILE.json [--port 0]`` prints one line
``{"ready": true, "port": N}`` and ends when its standard input closes. Clients send one JSON
object a line over TCP and get one line back: ``"ok": true``, or ``"ok": false`` with ``error`` (a
word) and ``message``. Metre, radian, second. Operations: `hello`, `robot`, `move`, `stop`,
`guide` (by hand), `measure`, `nests`, `stage`, `conditions`, `set`, `truth`.
"""

from __future__ import annotations

import argparse
import asyncio
import itertools
import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from drivers.emulators.motion import Segment
from drivers.emulators.process import report_ready, until_stdin_closes
from drivers.emulators.records import WorldError
from drivers.emulators.rigid import quaternion
from drivers.emulators.true_cell import TrueCell
from drivers.emulators.world_config import read_config

Request = Mapping[str, Any]
Reply = dict[str, Any]


def hello(cell: TrueCell, request: Request) -> Reply:
    """Say what the robot is and how fast the clock runs."""
    del request
    return {
        "n_joints": cell.table.n_joints,
        "prismatic": cell.table.prismatic,
        "limits": cell.nominal.limits,
        "time_scale": cell.clock.time_scale,
    }


def robot(cell: TrueCell, request: Request) -> Reply:
    """Give what the robot's controller believes, all of one moment."""
    del request
    now = cell.clock.now()
    # With a moment for each, a robot could be told at rest on its way to the target.
    return {
        "joints": cell.joints(now),
        "moving": cell.moving(now),
        "safety": cell.safety,
        "time_s": now,
    }


def move(cell: TrueCell, request: Request) -> Reply:
    """Start a joint motion; with `stop_on_disconnect` it ends when the client goes away."""
    target = tuple(float(q) for q in request["joints"])
    segment = cell.move(target, float(request["speed"]), float(request["acceleration"]))
    cell.guardian = request["client"] if request.get("stop_on_disconnect") else None
    return {"segment": asdict(segment)}


def stop(cell: TrueCell, request: Request) -> Reply:
    """Stop the robot."""
    segment: Segment = cell.stop(float(request["acceleration"]))
    return {"segment": asdict(segment)}


def guide(cell: TrueCell, request: Request) -> Reply:
    """Lead the robot by hand to these joints."""
    cell.guide(tuple(float(q) for q in request["joints"]))
    return {}


def measure(cell: TrueCell, request: Request) -> Reply:
    """Read the robot's target with the tracker, or the one in the nest named `target`."""
    return asdict(cell.measure(request.get("target")))


def nests(cell: TrueCell, request: Request) -> Reply:
    """Say which fixed nests there are, and where about in the tracker's frame."""
    del request
    return {"nests": {name: tuple(v * 1e-3 for v in at) for name, at in cell.config.nests.items()}}


def stage(cell: TrueCell, request: Request) -> Reply:
    """Read one sensor of the calibration stage."""
    sensor = request["sensor"]
    if sensor not in cell.stage:
        raise WorldError("no_sensor", f"No stage sensor {sensor!r}, there are {list(cell.stage)}.")
    return {"value": cell.stage[sensor]}


def conditions(cell: TrueCell, request: Request) -> Reply:
    """Give what a temperature probe and an operator know."""
    del request
    return {"temperature_degc": cell.temperature_degc(), "payload_kg": cell.payload_kg}


def _set_temperature(cell: TrueCell, value: float | None) -> None:
    cell.fixed_temperature_degc = None if value is None else float(value)


SETTINGS: dict[str, Callable[[TrueCell, Any], None]] = {
    "safety": TrueCell.set_safety,
    "beam_blocked": lambda cell, value: setattr(cell, "beam_blocked", bool(value)),
    "payload_kg": lambda cell, value: setattr(cell, "payload_kg", float(value)),
    "temperature_degc": _set_temperature,
    "time_scale": lambda cell, value: cell.clock.run_at(float(value)),
    "effect": TrueCell.add_effect,
    "effects": TrueCell.set_effects,
    "stage": lambda cell, value: cell.stage.update(value),
}


def set_value(cell: TrueCell, request: Request) -> Reply:
    """Switch a fault, a hidden effect or a condition."""
    name = request["name"]
    if name not in SETTINGS:
        raise WorldError("bad_request", f"Cannot set {name!r}, only {', '.join(SETTINGS)}.")
    SETTINGS[name](cell, request["value"])
    return {}


def truth(cell: TrueCell, request: Request) -> Reply:
    """Open the sealed truth; with `joints`, the target's true pose at those readings."""
    now = cell.circumstances(cell.clock.now())
    q = np.array(request.get("joints", cell.joints(float(now.time_s))), dtype=float)
    T = cell.target_pose(q, float(now.time_s))
    table = cell.table
    return {
        "theta": table.theta.tolist(),
        "d": table.d.tolist(),
        "a": table.a.tolist(),
        "alpha": table.alpha.tolist(),
        "beta": table.beta.tolist(),
        "prismatic": table.prismatic,
        "base": asdict(cell.base),
        "tool": asdict(cell.tool),
        "effects": [repr(effect) for effect in cell.effects],
        "circumstances": {name: np.asarray(value).tolist() for name, value in asdict(now).items()},
        "joints": q.tolist(),
        "true_joints": cell.true_joints(q, now).tolist(),
        "position": T[:3, 3].tolist(),
        "orientation": quaternion(T[:3, :3]),
    }


OPERATIONS: dict[str, Callable[[TrueCell, Request], Reply]] = {
    "hello": hello,
    "robot": robot,
    "move": move,
    "stop": stop,
    "guide": guide,
    "measure": measure,
    "nests": nests,
    "stage": stage,
    "conditions": conditions,
    "set": set_value,
    "truth": truth,
}


def operation_of(request: Request) -> Callable[[TrueCell, Request], Reply]:
    """Find the operation that a request names."""
    if request.get("op") not in OPERATIONS:
        raise WorldError("bad_request", f"op must be one of {', '.join(OPERATIONS)}.")
    return OPERATIONS[request["op"]]


def answer(cell: TrueCell, line: bytes, client: int) -> Reply:
    """Follow one request; what cannot be followed is answered, the world goes on."""
    try:
        request = json.loads(line)
        reply = operation_of(request)(cell, {**request, "client": client})
        return {"ok": True, "time_s": cell.clock.now(), **reply}
    except WorldError as refusal:
        return {"ok": False, "error": refusal.word, "message": str(refusal)}
    except (AttributeError, KeyError, TypeError, ValueError) as fault:
        return {"ok": False, "error": "bad_request", "message": f"{type(fault).__name__}: {fault}"}


async def serve(cell: TrueCell, host: str, port: int) -> None:
    """Answer any number of clients until standard input closes."""
    numbers = itertools.count()

    async def converse(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        client = next(numbers)
        try:
            while line := await reader.readline():
                writer.write(json.dumps(answer(cell, line, client)).encode() + b"\n")
                await writer.drain()
        except (ConnectionError, asyncio.CancelledError):
            return  # A killed client is no event in the world, and the world may end any time.
        finally:
            cell.abandon(client)
            writer.close()

    server = await asyncio.start_server(converse, host, port)
    report_ready(port=server.sockets[0].getsockname()[1])
    await until_stdin_closes()
    server.close()


def main() -> int:
    """Run the world of a configuration file."""
    parser = argparse.ArgumentParser(description="The emulated world of one robot cell.")
    parser.add_argument("--config", type=Path, required=True, help="configuration, JSON")
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on")
    parser.add_argument("--port", type=int, default=0, help="TCP port, 0 for a free one")
    options = parser.parse_args()
    try:
        cell = TrueCell(read_config(options.config))
    except WorldError as fault:
        sys.stderr.write(f"{fault}\n")
        return 2
    asyncio.run(serve(cell, options.host, options.port))
    return 0


if __name__ == "__main__":
    sys.exit(main())

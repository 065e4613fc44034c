"""A world and a GeoCOM station as processes, for the tests of the GeoCOM driver."""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from drivers.transport import LineSocket, ask_json

ROOT = Path(__file__).parents[2]

POST = """
name: post
convention: mdh
joints:
  - {type: revolute, theta_deg: 0, d_mm: 0, a_mm: 0, alpha_deg: 0, beta_deg: 0,
     limits_deg: [-180, 180]}
"""
"""A robot whose flange stands still at its base."""

WORLD = {
    "robot": "post.yaml",
    "time_scale": 100,
    "geometry_error": {"length_mm": 0, "angle_mrad": 0},
    "base": {"xyz_mm": [1234.567, 2345.678, 456.789], "ypr_deg": [0, 0, 0]},
    "tool": {"xyz_mm": [0, 0, 0], "ypr_deg": [0, 0, 0]},
    "noise": {"position_mm": 0, "ppm": 0, "orientation_mrad": 0},
    "repeatability_mm": 0,
    "nests": {"r1": [-800, 1500, -300]},
}
TARGET = (1.234567, 2.345678, 0.456789)
"""Where the target is [m], the point of the transcripts."""


class Emulator:
    """One emulator process."""

    def __init__(self, module: str, *arguments: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", f"drivers.emulators.{module}", *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            cwd=ROOT,
        )
        self.port = json.loads(self.process.stdout.readline())["port"]

    def order(self, **order: Any) -> dict[str, Any]:
        """Send one line of standard input and return its acknowledgement."""
        self.process.stdin.write(json.dumps(order).encode() + b"\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())

    def end(self) -> int:
        self.process.stdin.close()
        status = self.process.wait(5)
        self.process.stdout.close()
        return status


class Cell:
    """A running world and station."""

    def __init__(self, folder: Path, world: Emulator, station: Emulator) -> None:
        self.folder = folder
        self.world = world
        self.station = station
        self._line = LineSocket("world", f"127.0.0.1:{world.port}", 5.0)
        self._line.open()

    def set(self, name: str, value: Any) -> None:
        request = {"op": "set", "name": name, "value": value}
        assert ask_json(self._line, "world", "set", request).yes("ok")

    def move(self, joints: list[float]) -> None:
        """Put the robot elsewhere, in no time."""
        request = {"op": "move", "joints": joints, "speed": 1e3, "acceleration": 1e6}
        assert ask_json(self._line, "world", "move", request).yes("ok")
        while ask_json(self._line, "world", "robot", {"op": "robot"}).yes("moving"):
            pass

    def close(self) -> None:
        self._line.close()


@contextmanager
def geocom_cell(folder: Path, *station_arguments: str, **config: Any) -> Iterator[Cell]:
    """Run a world and a station that looks at it."""
    (folder / "post.yaml").write_text(POST)
    path = folder / "world.json"
    path.write_text(json.dumps({**WORLD, **config}))
    with ExitStack() as running:
        world = Emulator("world", "--config", str(path))
        running.callback(world.end)
        address = f"127.0.0.1:{world.port}"
        station = Emulator("geocom_station", "--world", address, *station_arguments)
        running.callback(station.end)
        cell = Cell(folder, world, station)
        running.callback(cell.close)
        yield cell

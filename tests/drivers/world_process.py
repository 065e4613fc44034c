"""The emulated world as a process, for tests."""

import json
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
ROBOTS = ROOT / "robocal" / "robots"

EXACT = {
    "geometry_error": {"length_mm": 0, "angle_mrad": 0},
    "base": {"xyz_mm": [0, 0, 0], "ypr_deg": [0, 0, 0]},
    "tool": {"xyz_mm": [0, 0, 0], "ypr_deg": [0, 0, 0]},
    "noise": {"position_mm": 0, "ppm": 0, "orientation_mrad": 0},
    "repeatability_mm": 0,
}
"""A cell without any error, its tracker in the robot's base and its target at the flange."""

PENDULUM = """
name: pendulum
convention: mdh
joints:
  - {type: revolute, theta_deg: 0, d_mm: 0, a_mm: 1000, alpha_deg: 0, beta_deg: 0,
     limits_deg: [-180, 180]}
links:
  - {mass_kg: 10, com_mm: [-400, 0, 0]}
"""
"""One joint that turns a rod of 1 m about z, the mass at 0.6 m."""


class World:
    """A world's process and one connection to it."""

    def __init__(self, folder: Path, config: dict[str, Any]) -> None:
        path = folder / "world.json"
        path.write_text(json.dumps(config))
        self.process = subprocess.Popen(
            [sys.executable, "-m", "drivers.emulators.world", "--config", str(path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            cwd=ROOT,
        )
        self.port = json.loads(self.process.stdout.readline())["port"]
        self.address = f"127.0.0.1:{self.port}"
        self._socket = socket.create_connection(("127.0.0.1", self.port), 5)
        self._lines = self._socket.makefile("rb")

    def send(self, line: bytes) -> dict[str, Any]:
        """Send raw bytes and return the reply, whatever it says."""
        self._socket.sendall(line + b"\n")
        return json.loads(self._lines.readline())

    def request(self, op: str, **arguments: Any) -> dict[str, Any]:
        return self.send(json.dumps({"op": op, **arguments}).encode())

    def ask(self, op: str, **arguments: Any) -> dict[str, Any]:
        reply = self.request(op, **arguments)
        assert reply["ok"], reply
        return reply

    def set(self, name: str, value: Any) -> None:
        self.ask("set", name=name, value=value)

    def move_and_wait(self, joints: list[float]) -> None:
        self.ask("move", joints=joints, speed=3.0, acceleration=30.0)
        while self.ask("robot")["moving"]:
            pass

    def end(self) -> int:
        self._lines.close()
        self._socket.close()
        self.process.stdin.close()
        status = self.process.wait(5)
        self.process.stdout.close()
        return status


@contextmanager
def world(folder: Path, robot: str | Path = "ur10e", **config: Any) -> Iterator[World]:
    """Run a world; `robot` is the name of one of the project's robots or the path of a file."""
    path = robot if isinstance(robot, Path) else ROBOTS / f"{robot}.yaml"
    started = World(folder, {"robot": str(path), **config})
    try:
        yield started
    finally:
        assert started.end() == 0


def pendulum(folder: Path) -> Path:
    """Write the one-joint robot's file."""
    path = folder / "pendulum.yaml"
    path.write_text(PENDULUM)
    return path

"""A world and UR controllers as processes, for the tests of the UR driver."""

import json
import math
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[2]
HERE = (0.0, -math.pi / 2, math.pi / 2, -math.pi / 2, -math.pi / 2, 0.0)
START_DEG = [math.degrees(q) for q in HERE]
PATIENCE_S = 60.0
"""For what is not promised in a time, on a machine that does ten other things."""


def address(number: int) -> str:
    """A loopback address of this test process alone: the ports of a UR are fixed."""
    pid = os.getpid()
    return f"127.{64 + pid % 64}.{pid // 64 % 256}.{number}"


def wait_until(
    condition: Callable[[], bool], within_s: float = PATIENCE_S, period_s: float = 0.004
) -> float:
    """Wait for an event; return how long it took [s]."""
    start_s = time.monotonic()
    while not condition():
        took_s = time.monotonic() - start_s
        assert took_s < within_s, f"did not happen within {within_s} s"
        time.sleep(period_s)
    return time.monotonic() - start_s


class Emulator:
    """One emulator process."""

    def __init__(self, module: str, *arguments: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", f"drivers.emulators.{module}", *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            cwd=ROOT,
        )
        self.ready = json.loads(self.process.stdout.readline())

    def order(self, **order: object) -> None:
        self.process.stdin.write(json.dumps(order).encode() + b"\n")
        self.process.stdin.flush()
        assert json.loads(self.process.stdout.readline())["ok"]

    def close(self) -> None:
        self.process.stdin.close()
        assert self.process.wait(5) == 0
        self.process.stdout.close()


class World:
    """A client of the world's process."""

    def __init__(self, port: int) -> None:
        self.address = f"127.0.0.1:{port}"
        self._socket = socket.create_connection(("127.0.0.1", port), PATIENCE_S)
        self._lines = self._socket.makefile("rb")

    def ask(self, op: str, **fields: object) -> dict:
        self._socket.sendall(json.dumps({"op": op, **fields}).encode() + b"\n")
        reply = json.loads(self._lines.readline())
        assert reply["ok"], reply
        return reply

    def joints(self) -> list[float]:
        return self.ask("robot")["joints"]

    def moving(self) -> bool:
        return self.ask("robot")["moving"]

    def at_rest(self) -> bool:
        return not self.moving()

    def set_safety(self, word: str) -> None:
        self.ask("set", name="safety", value=word)

    def close(self) -> None:
        self._lines.close()
        self._socket.close()


class Cell:
    """One world and one controller at an address."""

    def __init__(self, world: World, controller: Emulator, address: str, time_scale: float) -> None:
        self.world = world
        self.time_scale = time_scale
        self.controller = controller
        self.address = address

    def restore(self) -> None:
        """Put the cell back to where every test starts."""
        self.controller.order(fault="local_control", on=False)
        self.world.set_safety("normal")
        self.world.ask("set", name="time_scale", value=self.time_scale)
        self.world.ask("stop", acceleration=1e3)
        wait_until(self.world.at_rest)
        self.world.ask("move", joints=list(HERE), speed=1e2, acceleration=1e3)
        wait_until(self.world.at_rest)
        wait_until(lambda: self.dashboard("running") == "Program running: false")

    def dashboard(self, command: str) -> str:
        with socket.create_connection((self.address, 29999), PATIENCE_S) as connection:
            lines = connection.makefile("rw")
            lines.readline()
            lines.write(f"{command}\n")
            lines.flush()
            return lines.readline().strip()


@contextmanager
def emulated_cell(folder: Path, number: int = 2, time_scale: float = 10.0) -> Iterator[Cell]:
    """Start a world with a UR10e and its controller."""
    config = folder / f"world{number}.json"
    robot = str(ROOT / "robocal" / "robots" / "ur10e.yaml")
    entries = {"robot": robot, "time_scale": time_scale, "start_joints_deg": START_DEG}
    config.write_text(json.dumps(entries))
    with ExitStack() as stack:
        world_process = Emulator("world", "--config", str(config))
        stack.callback(world_process.close)
        port = world_process.ready["port"]
        world = World(port)
        stack.callback(world.close)
        controller = Emulator(
            "ur_controller", "--world", f"127.0.0.1:{port}", "--address", address(number)
        )
        stack.callback(controller.close)
        yield Cell(world, controller, address(number), time_scale)

"""A world and a robot controller over Modbus TCP as processes, for the tests of its driver."""

import json
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from ur_cell import ROOT, Emulator, World, wait_until

from drivers.interfaces import JointMotion

PROFILES = ROOT / "drivers" / "profiles"
STOP_WITHIN_S = 0.3
HERE = {"ur10e": (0.0, -1.5, 1.5, -1.5, -1.5, 0.0), "abb_irb910sc": (0.1, 0.2, 0.05, 0.3)}


class Cell:
    """One world and one controller."""

    def __init__(self, world: World, controller: Emulator, robot: str, time_scale: float) -> None:
        self.world = world
        self.controller = controller
        self.here = HERE[robot]
        self.address = f"127.0.0.1:{controller.ready['port']}"
        self.time_scale = time_scale

    def fault(self, kind: str, **order: Any) -> None:
        self.controller.order(fault=kind, **order)

    def restore(self) -> None:
        """Put the cell back to where every test starts."""
        self.fault("none")
        self.world.set_safety("normal")
        self.world.ask("set", name="time_scale", value=self.time_scale)
        self.world.ask("stop", acceleration=1e3)
        wait_until(self.world.at_rest)
        self.world.ask("move", joints=list(self.here), speed=1e2, acceleration=1e3)
        wait_until(self.world.at_rest)


@contextmanager
def modbus_cell(
    folder: Path, robot: str = "ur10e", layout: str = "generic", time_scale: float = 10.0
) -> Iterator[Cell]:
    """Start a world and a controller in front of it."""
    path = folder / "world.json"
    file = str(ROOT / "robocal" / "robots" / f"{robot}.yaml")
    path.write_text(json.dumps({"robot": file, "time_scale": time_scale}))
    with ExitStack() as stack:
        world_process = Emulator("world", "--config", str(path))
        stack.callback(world_process.close)
        port = world_process.ready["port"]
        world = World(port)
        stack.callback(world.close)
        controller = Emulator("modbus_robot", "--world", f"127.0.0.1:{port}", "--layout", layout)
        stack.callback(controller.close)
        cell = Cell(world, controller, robot, time_scale)
        cell.restore()
        yield cell


def quick(cell: Cell) -> JointMotion:
    return JointMotion((cell.here[0] + 0.1, *cell.here[1:]), 1.0, 2.0, deadline_s=5.0)


def slow(cell: Cell) -> JointMotion:
    return JointMotion((3.0, *cell.here[1:]), speed=0.1, acceleration=1.0, deadline_s=20.0)


def go_on() -> bool:
    return True


def once_moving(cell: Cell, action: Callable[[], object]) -> Callable[[], bool]:
    """Permission that does something once, when the world's robot moves."""
    done = []

    def may_continue() -> bool:
        if not done and cell.world.joints()[0] > cell.here[0] + 0.02:
            done.append(time.monotonic())
            return action() is not False
        return True

    may_continue.done = done
    return may_continue


def assert_stays(cell: Cell, for_s: float = 0.4) -> None:
    stopped_at = cell.world.joints()
    end_s = time.monotonic() + for_s
    while time.monotonic() < end_s:
        assert cell.world.joints() == stopped_at
        time.sleep(0.05)

"""An emulated cell for people and demonstrations: world, robot controller, tracker, as processes.

Emulators are started as programs of their own and are never imported. Where this system lacks the
robot's client library or serial lines, the cell is offered through the mock drivers, and says so.
"""

import importlib.util
import json
import os
import socket
import sys
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from types import TracebackType

from robocal.robots.library import robot_path
from service.child_process import ChildProcess

NEST, NEST_MM = "r1", (1500.0, -900.0, 200.0)
"""A reference nest beside the robot, in the tracker's frame."""
_UR_PORTS = (30004, 29999, 30003)


@dataclass(frozen=True)
class CellAddresses:
    """Drivers and addresses as a cell's settings name them."""

    robot_driver: str
    robot_address: str
    tracker_driver: str
    tracker_address: str
    world_address: str
    """For the mock drivers: the temperature probe has no wire here."""
    note: str
    """What is not as on a Linux machine with the UR client, empty otherwise."""


class EmulatedCell:
    """Context manager: the emulators run inside it.

    Parameters
    ----------
    robot
        Name of a robot of the library.
    time_scale
        How much faster than real time the world's clock runs.
    seed
        Of the true geometry, the frames and the noise.
    effects
        Hidden in the cell, as the emulated world takes them.
    """

    def __init__(
        self,
        robot: str,
        time_scale: float,
        seed: int,
        effects: Sequence[Mapping[str, object]] = (),
    ) -> None:
        self._robot = robot
        self._config = {
            "robot": str(robot_path(robot)),
            "seed": seed,
            "time_scale": time_scale,
            "nests": {NEST: NEST_MM},
            "temperature": {"start_degc": 20.0, "final_degc": 32.0},
            "effects": list(effects),
        }
        self._stack = ExitStack()

    def __enter__(self) -> CellAddresses:
        with ExitStack() as stack:
            folder = Path(stack.enter_context(TemporaryDirectory()))
            config = folder / "world.json"
            config.write_text(json.dumps(self._config), encoding="utf-8")
            world = f"127.0.0.1:{start_emulator(stack, 'world', '--config', str(config))}"
            addresses = self._wires(stack, world)
            self._stack = stack.pop_all()
        return addresses

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stack.close()

    def _wires(self, stack: ExitStack, world: str) -> CellAddresses:
        driver, controller, missing = emulated_controller(stack, self._robot, world)
        if missing:
            return CellAddresses("mock", world, "mock", world, world, missing)
        tracker = str(start_emulator(stack, "geocom_station", "--world", world))
        return CellAddresses(driver, controller, "geocom", tracker, world, "")


def start_emulator(stack: ExitStack, emulator: str, *arguments: str) -> object:
    """Start one emulator and return the port that it names."""
    child = ChildProcess(f"drivers.emulators.{emulator}", *arguments)
    stack.callback(child.close)
    return child.ready().get("port")


def emulated_controller(stack: ExitStack, robot: str, world: str) -> tuple[str, str, str]:
    """Start the controller of a robot; its driver, its address, and why it is the mock driver."""
    missing = _missing(robot)
    if missing:
        return "mock", world, missing
    controller = _free_loopback()
    start_emulator(stack, "ur_controller", "--world", world, "--address", controller)
    return "ur_rtde", controller, ""


def _missing(robot: str) -> str:
    """Why the real wires cannot be used here; empty if they can."""
    if not robot.startswith("ur"):
        return f"{robot} has no emulated controller yet; mock drivers stand in"
    if importlib.util.find_spec("rtde_control") is None:
        return "ur-rtde has no package for this system; mock drivers stand in"
    if sys.platform == "win32":
        return "Windows has no pseudo-terminals; mock drivers stand in"
    if sys.platform != "linux":
        return "127.0.0.2 needs Linux; mock drivers stand in"
    return ""


def _free_loopback() -> str:
    """A loopback address whose three fixed UR ports are free."""
    # Programs that start at the same moment look at different ones.
    block = os.getpid() % 200
    for last in range(2, 250):
        address = f"127.0.{block}.{last}"
        if all(_is_free(address, port) for port in _UR_PORTS):
            return address
    raise OSError("no loopback address has ports 30004, 29999 and 30003 free")


def _is_free(address: str, port: int) -> bool:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((address, port))
        except OSError:
            return False
    return True

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

from robocal.errors import BadInput
from robocal.robots.library import robot_path
from service.child_process import ChildProcess
from service.emulated_faults import Wire

NEST, NEST_MM = "r1", (1500.0, -900.0, 200.0)
"""A reference nest beside the robot, in the tracker's frame."""
_UR_PORTS = (30004, 29999, 30003)


ROBOTS, TRACKERS, PROBES = (
    ("ur_rtde", "modbus", "mock"),
    ("geocom", "ndi", "relay", "mock"),
    ("modbus_temperature", "mock"),
)
"""Drivers that an emulated cell can be reached through, the usual one first."""
_SERIAL = {
    "geocom": "geocom_station",
    "ndi": "ndi_camera",
    "relay": "relay_host",
    "modbus_temperature": "temperature_transmitter",
}
"""Emulators of the drivers on serial lines."""


@dataclass(frozen=True)
class Wires:
    """Drivers to reach the cell through; empty: the usual one."""

    robot: str = ""
    tracker: str = ""
    probe: str = ""


@dataclass(frozen=True)
class CellAddresses:
    """Drivers and addresses as a cell's settings name them."""

    robot: Wire
    tracker: Wire
    probe: Wire
    world: str
    """Of the emulated world, host:port."""
    note: str
    """What is not as on a Linux machine with the UR client, empty otherwise."""

    @property
    def wires(self) -> dict[str, Wire]:
        """By the part of the cell."""
        return {"robot": self.robot, "tracker": self.tracker, "probe": self.probe}


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
    wires
        Drivers to reach it through.
    """

    def __init__(
        self,
        robot: str,
        time_scale: float,
        seed: int,
        effects: Sequence[Mapping[str, object]] = (),
        wires: Wires | None = None,
    ) -> None:
        self._robot = robot
        self._wires = wires or Wires()
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
            folder = Path(stack.enter_context(TemporaryDirectory(prefix="robocal-")))
            config = folder / "world.json"
            config.write_text(json.dumps(self._config), encoding="utf-8")
            _, port = start_emulator(stack, "world", "--config", str(config))
            addresses = self._connected(stack, f"127.0.0.1:{port}", folder)
            self._stack = stack.pop_all()
        return addresses

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stack.close()

    def _connected(self, stack: ExitStack, world: str, folder: Path) -> CellAddresses:
        robot, note = emulated_controller(stack, self._robot, world, self._wires.robot)
        usual = "mock" if note else ""
        tracker = self._wires.tracker or usual or TRACKERS[0]
        probe = self._wires.probe or usual or PROBES[0]
        return CellAddresses(
            robot,
            _serial_wire(stack, "tracker", tracker, world, folder),
            _serial_wire(stack, "probe", probe, world, folder),
            world,
            note,
        )


def start_emulator(stack: ExitStack, emulator: str, *arguments: str) -> tuple[ChildProcess, object]:
    """Start one emulator; it, and the port that it names."""
    child = ChildProcess(f"drivers.emulators.{emulator}", *arguments)
    stack.callback(child.close)
    return child, child.ready().get("port")


def emulated_controller(
    stack: ExitStack, robot: str, world: str, driver: str = ""
) -> tuple[Wire, str]:
    """Start the controller of a robot; how to reach it, and why the mock driver stands in."""
    if not driver and not robot.startswith("ur"):
        driver = "modbus"
    if driver == "modbus":
        controller, port = start_emulator(stack, "modbus_robot", "--world", world)
        return Wire("modbus", f"127.0.0.1:{port}", controller), ""
    missing = _missing(robot)
    if driver == "ur_rtde" and missing:
        raise BadInput("robot driver ur_rtde", missing)
    if driver == "mock" or missing:
        return Wire("mock", world), missing
    address = _free_loopback()
    controller, _ = start_emulator(stack, "ur_controller", "--world", world, "--address", address)
    return Wire("ur_rtde", address, controller), ""


def _serial_wire(stack: ExitStack, part: str, driver: str, world: str, folder: Path) -> Wire:
    if driver == "mock":
        return Wire("mock", world)
    if os.name != "posix":
        raise BadInput(f"{part} driver {driver}", "needs pseudo-terminals, which are not here")
    # A link keeps its name when the cable is pulled and put back.
    link = str(folder / part)
    emulator, _ = start_emulator(stack, _SERIAL[driver], "--world", world, "--link", link)
    return Wire(driver, link, emulator)


def _missing(robot: str) -> str:
    """Why the real wires cannot be used here; empty if they can."""
    if not robot.startswith("ur"):
        return f"{robot} is no robot of Universal Robots"
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

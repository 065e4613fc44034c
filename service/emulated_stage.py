"""An emulated sensing stage between two robots, for people and tests, all as processes.

A six-axis arm behind its RTDE controller is the master, a SCARA behind a Modbus controller the
slave; the stage's rangefinder, encoder and gauge hang on pseudo-terminals. Where this system lacks
the arm's client library, the mock driver stands in, and the note says so.
"""

import json
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from types import TracebackType
from typing import Any

from robocal.robots.library import robot_path
from service.emulated_cell import emulated_controller, start_emulator
from service.emulated_faults import Wire
from service.world_client import WorldClient

MASTER, SLAVE = "ur10e", "abb_irb910sc"
NEEDLES_MM = {MASTER: (0.0, 0.0, 150.0), SLAVE: (0.0, 0.0, 100.0)}
STAGE = {"xyz_mm": [750, 350, 400], "ypr_deg": [0.4, 0.2, -0.3]}
SLAVE_BASE = {"xyz_mm": [2103.7, 498.2, 361.5], "ypr_deg": [171.3, 0.4, -0.6]}
RANGES = {
    "slide_range_mm": (0.0, 1500.0),
    "rod_angle_range_deg": (-60.0, 60.0),
    "rod_length_range_mm": (250.0, 450.0),
}
"""Of the emulated stage, as a base calibration's `stage` takes them."""
_START_DEG = {MASTER: [0, -60, 100, -130, -90, 0], SLAVE: [20, 40, 60, 0]}
_INSTRUMENTS = {
    "slide": ("dimetix", "dimetix_rangefinder", (), "?frame=8N1"),
    "rod_angle": ("lika", "lika_encoder", ("--counts", "65536"), ""),
    "rod_length": ("magnescale", "magnescale_gauge", (), ""),
}
"""Driver, emulator, its options, and what follows the port in the address."""


@dataclass(frozen=True)
class StageAddresses:
    """What runs, and where."""

    master: Wire
    slave: Wire
    sensors: Mapping[str, Wire]
    stage_world: str
    """Where the needle is led into a cup, host:port."""
    note: str
    """What is not as on a Linux machine with the UR client, empty otherwise."""

    @property
    def wires(self) -> dict[str, Wire]:
        """By the part of the stage."""
        return {"master": self.master, "slave": self.slave, **self.sensors}

    def request(self, name: str) -> dict[str, Any]:
        """Body of POST /base-calibrations for this stage."""
        robots = {
            role: {
                "robot": {"model": model, "driver": wire.driver, "address": wire.address},
                "needle_mm": list(NEEDLES_MM[model]),
            }
            for role, model, wire in (
                ("master", MASTER, self.master),
                ("slave", SLAVE, self.slave),
            )
        }
        sensors = {
            sensor: {"driver": wire.driver, "address": wire.address}
            for sensor, wire in self.sensors.items()
        }
        ranges = {key: list(values) for key, values in RANGES.items()}
        return {"name": name, **robots, "stage": {"sensors": sensors, **ranges}}


class EmulatedStage:
    """Context manager: the emulators run inside it.

    Parameters
    ----------
    seed
        Of the sensors' errors and the needles' seats.
    faults
        Hidden faults of the stage, as `drivers.emulators.stage_geometry` names them.
    """

    def __init__(self, seed: int, faults: Mapping[str, float] | None = None) -> None:
        self._seed = seed
        self._faults = dict(faults or {})
        self._stack = ExitStack()

    def __enter__(self) -> StageAddresses:
        with ExitStack() as stack:
            folder = Path(stack.enter_context(TemporaryDirectory(prefix="robocal-")))
            worlds = {robot: _world(stack, folder, robot, self._seed) for robot in (MASTER, SLAVE)}
            stage = self._stage_world(stack, folder, worlds)
            master, note = emulated_controller(stack, MASTER, worlds[MASTER])
            slave, _ = emulated_controller(stack, SLAVE, worlds[SLAVE])
            sensors = {sensor: _sensor(stack, sensor, stage, folder) for sensor in _INSTRUMENTS}
            self._stack = stack.pop_all()
        return StageAddresses(master, slave, sensors, stage, note)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stack.close()

    def _stage_world(self, stack: ExitStack, folder: Path, worlds: Mapping[str, str]) -> str:
        config = folder / "stage.json"
        entries = {
            "master": worlds[MASTER],
            "slave": worlds[SLAVE],
            "stage": STAGE,
            "slave_base": SLAVE_BASE,
            "seed": self._seed,
            "faults": self._faults,
        }
        config.write_text(json.dumps(entries), encoding="utf-8")
        _, port = start_emulator(stack, "stage_world", "--config", str(config))
        return f"127.0.0.1:{port}"


def _world(stack: ExitStack, folder: Path, robot: str, seed: int) -> str:
    """Start the world of a robot that is as its data sheet says, needle and all."""
    config = folder / f"{robot}.json"
    at_origin = {"xyz_mm": [0, 0, 0], "ypr_deg": [0, 0, 0]}
    entries = {
        "robot": str(robot_path(robot)),
        "seed": seed,
        "geometry_error": {"length_mm": 0, "angle_mrad": 0},
        "base": at_origin,
        "tool": {**at_origin, "xyz_mm": list(NEEDLES_MM[robot])},
        "start_joints_deg": _START_DEG[robot],
    }
    config.write_text(json.dumps(entries), encoding="utf-8")
    _, port = start_emulator(stack, "world", "--config", str(config))
    return f"127.0.0.1:{port}"


def _sensor(stack: ExitStack, sensor: str, stage: str, folder: Path) -> Wire:
    driver, emulator, options, tail = _INSTRUMENTS[sensor]
    # A link keeps its name when the cable is pulled and put back.
    link = str(folder / sensor)
    about = ("--world", stage, "--sensor", sensor, "--link", link, *options)
    child, _ = start_emulator(stack, emulator, *about)
    return Wire(driver, f"{link}{tail}", child)


class StageHands(WorldClient):
    """A person at the emulated stage: leads needles into cups."""

    def touch(self, robot: str, cup: str, **about: object) -> dict[str, Any]:
        """Lead a needle into a cup."""
        return self.ask("touch", robot=robot, cup=cup, **about)

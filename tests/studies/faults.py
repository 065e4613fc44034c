"""Every fault of every device in the middle of a campaign: what is lost, wrong, or left moving.

`python -m tests.studies.faults [--device geocom ...] [--fault silence ...]` drives a short campaign
for every pair, spoils one reply and then all replies until the campaign is paused, mends the
fault, resumes, and compares every stored reading with what the noiseless world holds. The sensors
of the stage are spoilt while a touch is taken, see `touch_faults`.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from tests.credentials import KEY, SETTING

os.environ.setdefault(SETTING, KEY)

from tests.integration.service_cell import (
    Site,
    World,
    emulated_world,
    installation,
    poses_about_start,
    wait_until,
)
from tests.integration.ur_cell import Emulator
from tests.studies import touch_faults
from tests.studies.fault_outcome import LASTING, Outcome

POSES, SPOILT_AFTER = 7, 2
WRONG_MM = 0.05
"""A reading further than this from the true one is wrong: rounding on the wire is below it."""
PATIENCE_S = 90.0
WARM_DEGC, WRONG_DEGC = 27.5, 0.02
WORLD = {
    "temperature": {"start_degc": WARM_DEGC, "final_degc": WARM_DEGC},
    "time_scale": 40,
    "geometry_error": {"length_mm": 0, "angle_mrad": 0},
    "noise": {"position_mm": 0, "ppm": 0, "orientation_mrad": 0},
    "repeatability_mm": 0,
}
Order = dict[str, object]


@dataclass(frozen=True)
class Device:
    """One driver with the emulator that speaks its wire."""

    name: str
    part: str
    """Of the cell: robot, tracker, temperature_probe."""
    driver: str
    emulator: tuple[str, ...]
    faults: tuple[str, ...]
    options: str = ""
    """Behind the address."""
    serial: bool = False
    settle_s: tuple[float, float] = (0.1, 0.1)
    """Of each pose under a fault of one reply, and under a lasting one, on the world's clock."""
    orders: dict[str, Order] = field(default_factory=dict)
    """How its emulator calls a fault, where not by the same name."""


_WIRE = ("silence", "late_reply", "cut_reply", "noise", "frozen")
_CABLE = ("unplugged", "wrong_baud")
_LASTS = {*_CABLE, "half_open", "refused", "local_control"}
"""Faults that are not of single replies."""
_TCP = ("silence", "late_reply", "cut_reply", "noise", "wrong_id", "frozen", "code")
DEVICES = (
    Device(
        "UR over RTDE",
        "robot",
        "ur_rtde",
        ("ur_controller",),
        ("silence", "reset", "refused", "frozen", "local_control"),
        orders={
            "silence": {"fault": "silent", "on": True},
            "reset": {"fault": "dropped"},
            "refused": {"fault": "refused", "on": True},
            "frozen": {"fault": "frozen", "on": True},
            "local_control": {"fault": "local_control", "on": True},
        },
    ),
    Device(
        "robot over Modbus TCP",
        "robot",
        "modbus",
        ("modbus_robot",),
        (*_TCP, "reset", "half_open", "refused"),
    ),
    Device(
        "GeoCOM station",
        "tracker",
        "geocom",
        ("geocom_station",),
        (*_WIRE, "wrong_checksum", "wrong_id", "code", *_CABLE),
        serial=True,
    ),
    Device(
        "NDI camera",
        "tracker",
        "ndi",
        ("ndi_camera",),
        (*_WIRE, "wrong_checksum", "wrong_id", "code", *_CABLE),
        serial=True,
    ),
    Device(
        "relayed tracker",
        "tracker",
        "relay",
        ("relay_host",),
        (*_WIRE, "wrong_checksum", "wrong_id", "code", *_CABLE),
        options="?profile=relay_triggered_6d",
        serial=True,
    ),
    Device(
        "temperature probe",
        "temperature_probe",
        "modbus_temperature",
        ("temperature_transmitter",),
        (*_WIRE, "wrong_checksum", "wrong_id", "code", *_CABLE),
        serial=True,
        # A probe is polled every second, and its last value is good for 15 s.
        settle_s=(60.0, 200.0),
    ),
)


@dataclass
class Rig:
    """A cell of the service with one device under test."""

    device: Device
    site: Site
    world: World
    folder: Path
    cell: str
    running: Emulator
    reference: dict[int, tuple[float, float, float]] = field(default_factory=dict)

    def spoil(self, fault: str, replies: int) -> None:
        """Let a fault begin."""
        order = self.device.orders.get(fault)
        if order is None:
            order = {"fault": fault}
            if fault not in _LASTS:
                order |= {"replies": replies}
            if fault == "late_reply":
                order |= {"delay_s": 4.0}
            if fault == "code":
                order |= {"code": 1285 if self.device.driver == "geocom" else 4}
        self.running.order(**order)

    def mend(self, fault: str) -> None:
        """Let a fault end."""
        if fault == "unplugged":
            self.running.order(fault="plugged")
        elif fault in self.device.orders:
            order = self.device.orders[fault]
            if "on" in order:
                self.running.order(**order | {"on": False})
        else:
            self.running.order(fault="none")


def start(device: Device, world: World, folder: Path) -> Emulator:
    """Start the emulator of a device."""
    module, *options = device.emulator
    if device.driver == "ur_rtde":
        options += ["--address", loopback()]
    elif device.serial:
        options += ["--link", str(folder / "port")]
    return Emulator(module, "--world", world.address, *options)


def loopback() -> str:
    """A loopback address of this process alone: the ports of a UR are fixed."""
    return f"127.{64 + os.getpid() % 64}.{os.getpid() // 64 % 256}.9"


def address_of(device: Device, running: Emulator, folder: Path) -> str:
    """Where the driver finds it."""
    if device.driver == "ur_rtde":
        return loopback()
    if device.serial:
        return f"{folder / 'port'}{device.options}"
    return f"127.0.0.1:{running.ready['port']}{device.options}"


@contextmanager
def rig_of(device: Device, site: Site, folder: Path) -> Iterator[Rig]:
    """Start a world, the device and a cell around them."""
    folder.mkdir()
    with ExitStack() as stack:
        world = stack.enter_context(emulated_world(folder, **WORLD))
        running = start(device, world, folder)
        name = device.driver
        mock = {"driver": "mock", "address": world.address}
        cell = {
            "name": name,
            "robot": {"model": "ur10e", **mock},
            "tracker": mock,
            "limits": {"floor_mm": None},
        }
        own = {"driver": device.driver, "address": address_of(device, running, folder)}
        cell[device.part] = {**cell.get(device.part, {}), **own}
        answer = site.post("/cells", cell)
        assert answer.status_code == 201, answer.text
        rig = Rig(device, site, world, folder, name, running)
        stack.callback(lambda: rig.running.close())
        rig.reference = {pose: at for pose, (at, _) in clean_readings(rig).items()}
        yield rig


def begin(rig: Rig, settle_s: float = 0.1) -> int:
    """Arm the cell and start a campaign."""
    assert rig.site.post(f"/cells/{rig.cell}/arm").status_code == 200
    return rig.site.start_campaign(poses_about_start(POSES), cell=rig.cell, settle_s=settle_s)


def finish(rig: Rig, number: int) -> None:
    """End a campaign that has its readings: what they mean is not the question here."""
    rig.site.post(f"/campaigns/{number}/abort")
    wait_until(lambda: rig.site.campaign(number)["state"] in ("aborted", "failed", "finished"), 30)


def readings(rig: Rig, number: int) -> dict[int, tuple[tuple[float, float, float], float | None]]:
    """Positions and temperatures by pose; a pose that is there twice counts as none."""
    rows = rig.site.get(f"/campaigns/{number}/measurements").json()["rows"]
    found = {}
    for row in rows:
        at = (row["x_mm"], row["y_mm"], row["z_mm"])
        assert row["pose"] not in found, "a reading was doubled"
        found[row["pose"]] = (at, row["temperature_degc"])
    return found


def clean_readings(rig: Rig) -> dict[int, tuple[tuple[float, float, float], float | None]]:
    """What the device says when nothing is wrong."""
    number = begin(rig)
    wait_until(lambda: rig.site.campaign(number)["done"] >= POSES, PATIENCE_S, 0.05)
    found = readings(rig, number)
    finish(rig, number)
    return found


def tried(rig: Rig, fault: str, replies: int) -> Outcome:
    """Drive one campaign through a fault."""
    number = begin(rig, rig.device.settle_s[replies == LASTING])
    shown = lambda: rig.site.campaign(number)  # noqa: E731
    wait_until(lambda: shown()["done"] >= SPOILT_AFTER, PATIENCE_S, 0.02)
    rig.spoil(fault, replies)
    word, sentence, moving, mended = "recovered", "", 0, False
    deadline = time.monotonic() + PATIENCE_S
    while (now := shown())["done"] < POSES and time.monotonic() < deadline:
        if now["state"] == "paused":
            word, sentence = "resumed", now["reason"]
            moving += int(rig.world.ask("robot")["moving"])
            if not mended:
                rig.mend(fault)
            mended = True
            rig.site.post(f"/cells/{rig.cell}/arm")
            rig.site.post(f"/campaigns/{number}/resume")
        elif now["state"] in {"failed", "aborted", "finished"}:
            word, sentence = now["state"], now["reason"]
            break
        time.sleep(0.05)
    if shown()["done"] < POSES and word in {"recovered", "resumed"}:
        word = "stuck"
    found = readings(rig, number)
    finish(rig, number)
    if not mended:
        rig.mend(fault)
    wrong = sum(
        distance(at, rig.reference[pose]) > WRONG_MM or not is_warm(rig, degc)
        for pose, (at, degc) in found.items()
    )
    return Outcome(word, sentence, POSES - len(found), wrong, moving)


def distance(one: tuple[float, ...], other: tuple[float, ...]) -> float:
    """Between two points [mm]."""
    return sum((a - b) ** 2 for a, b in zip(one, other, strict=True)) ** 0.5


def is_warm(rig: Rig, degc: float | None) -> bool:
    """Whether a reading has the world's temperature, where there is a probe."""
    probed = rig.device.part == "temperature_probe"
    return not probed or (degc is not None and abs(degc - WARM_DEGC) < WRONG_DEGC)


def main() -> int:
    """Print one line for every pair, and the sums."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--device", nargs="*", help="drivers; all by default")
    parser.add_argument("--fault", nargs="*", help="faults; all by default")
    options = parser.parse_args()
    outcomes = []
    with (
        tempfile.TemporaryDirectory(prefix="faults-") as name,
        installation(Path(name), lease_s=3.0) as site,
    ):
        for device in DEVICES:
            if options.device and device.driver not in options.device:
                continue
            with rig_of(device, site, Path(name) / device.driver) as rig:
                for fault in device.faults:
                    if options.fault and fault not in options.fault:
                        continue
                    for much, replies in times_of(device, fault):
                        outcome = tried(rig, fault, replies)
                        outcomes.append(outcome)
                        report(device.name, fault, much, outcome)
        for name_of, fault, much, outcome in touch_faults.outcomes(
            site, options.device, options.fault
        ):
            outcomes.append(outcome)
            report(name_of, fault, much, outcome)
    survived = sum(outcome.survived for outcome in outcomes)
    print(
        f"{len(outcomes)} campaigns and touches: survived {survived}, "
        f"readings lost {sum(o.lost for o in outcomes)}, wrong {sum(o.wrong for o in outcomes)}, "
        f"robot left moving {sum(o.moving for o in outcomes)}"
    )
    return 0 if survived == len(outcomes) else 1


def times_of(device: Device, fault: str) -> list[tuple[str, int]]:
    """How many replies are spoilt, where a fault is one of replies."""
    if device.driver == "ur_rtde":
        return [("once", 1)] if fault == "reset" else [("lasting", LASTING)]
    lasts = fault in _LASTS or (device.driver, fault) == ("modbus", "frozen")
    return [("lasting", LASTING)] if lasts else [("once", 1), ("lasting", LASTING)]


def report(device: str, fault: str, much: str, outcome: Outcome) -> None:
    """Print one line."""
    good = "survived" if outcome.survived else "NOT SURVIVED"
    counts = f"{outcome.lost} lost, {outcome.wrong} wrong, {outcome.moving} moving"
    print(f"{device:24}{fault:15}{much:9}{outcome.word:11}{good:13}{counts}", flush=True)
    if outcome.sentence:
        print(f"    {outcome.sentence}", flush=True)


if __name__ == "__main__":
    sys.exit(main())

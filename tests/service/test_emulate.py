"""`robocal emulate`: any wires, and a switch for every fault and effect while it runs."""

import json
import os
import signal
import subprocess
import sys
from argparse import Namespace
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from drivers.emulators import (
    dimetix_rangefinder,
    geocom_faults,
    lika_encoder,
    magnescale_gauge,
    modbus_wire,
    ndi_camera,
    relay_host,
    temperature_transmitter,
    wire_faults,
)
from drivers.errors import DriverError, Refused
from drivers.interfaces import Safety
from drivers.registry import open_robot, open_temperature_probe, open_tracker
from service.emulated_cell import PROBES, ROBOTS, TRACKERS
from service.emulated_faults import FAULTS
from tests.service.terminal import obey_ctrl_c

ENTRY = "from service.cli import main; main()"
OPTIONS = Namespace(tools=1, form="triggered_6d", id=1, sensor="s", counts=4096, unit="mm")
SERIAL = {
    "ndi": ndi_camera,
    "relay": relay_host,
    "modbus_temperature": temperature_transmitter,
    "dimetix": dimetix_rangefinder,
    "lika": lika_encoder,
    "magnescale": magnescale_gauge,
}

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs pseudo-terminals")


def test_each_driver_that_may_be_chosen_has_faults():
    assert {*ROBOTS, *TRACKERS, *PROBES, *SERIAL} - {"mock"} == set(FAULTS)


@pytest.mark.parametrize("driver", SERIAL)
def test_each_fault_of_a_serial_line_is_one_that_its_emulator_plays(driver):
    played = SERIAL[driver].make(None, OPTIONS).spoil
    known = {*wire_faults.WIRE_KINDS, *wire_faults.CABLE_KINDS, *played}
    assert set(FAULTS[driver]) == known


def test_each_fault_of_station_and_modbus_robot_is_one_that_its_emulator_plays():
    assert set(FAULTS["geocom"]) == set(geocom_faults.KINDS)
    assert set(FAULTS["modbus"]) == set(modbus_wire.KINDS) - {"wrong_transaction"}


class Emulated:
    """The command, typed at."""

    def __init__(self, folder: Path, *options: str) -> None:
        self.file = folder / "cell.json"
        self.process = subprocess.Popen(
            [sys.executable, "-c", ENTRY, "emulate", "--cell", str(self.file), *options],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            preexec_fn=obey_ctrl_c,
        )
        self.said = ""
        while "Ctrl+C" not in self.said:
            line = self.process.stdout.readline()
            assert line, self.said
            self.said += line

    def type(self, line: str) -> str:
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        return self.process.stdout.readline().strip()

    def end(self, number: int = signal.SIGINT) -> int:
        self.process.send_signal(number)
        try:
            return self.process.wait(60)
        finally:
            self.process.stdin.close()
            self.process.stdout.close()


@contextmanager
def emulated_by(folder: Path, *options: str) -> Iterator[Emulated]:
    """A running command that ends with the block."""
    emulated = Emulated(folder, *options)
    try:
        yield emulated
    finally:
        assert emulated.end() == 0


def test_wires_faults_and_effects_of_an_emulated_cell_are_chosen_by_its_user(tmp_path):
    wires = ("--robot-driver", "modbus", "--tracker", "relay", "--fault", "relay:code")
    with emulated_by(tmp_path, *wires) as emulated:
        assert "tracker (relay): code" in emulated.said
        cell = json.loads(emulated.file.read_text())
        try_out(emulated, cell)
        assert "tracker: has no fault 'local_control'" in emulated.type("tracker local_control")
        assert "'delay_s=soon'" in emulated.type("tracker late_reply delay_s=soon")
        assert "'nothing' is unknown" in emulated.type('set effect {"effect": "nothing"}')
    assert not Path(cell["tracker"]["address"]).exists()


@pytest.mark.parametrize("kind", [(), ("--stage",)])
def test_sigterm_ends_it_as_ctrl_c_does_and_leaves_no_folder(tmp_path, monkeypatch, kind):
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    emulated = Emulated(tmp_path, *kind)
    assert list(folder.glob("robocal-*"))
    assert emulated.end(signal.SIGTERM) == 0
    assert list(folder.iterdir()) == []


def try_out(emulated: Emulated, cell: dict) -> None:
    """Switch a fault off, and two of the world's conditions on."""
    assert cell["robot"].pop("model") == "ur10e"
    with (
        closing(open_tracker(**cell["tracker"])) as tracker,
        closing(open_robot(**cell["robot"], n_joints=6)) as robot,
        closing(open_temperature_probe(**cell["temperature_probe"])) as probe,
    ):
        tracker.connect()
        with pytest.raises(Refused, match="WARM"):
            tracker.measure()
        assert emulated.type("tracker none") == "tracker (relay): as it should be"
        tracker.measure()
        robot.connect()
        assert emulated.type("set safety protective_stop") == "safety is protective_stop"
        assert robot.state().safety == Safety.protective_stop
        probe.connect()
        assert emulated.type("set temperature_degc 35") == "temperature_degc is 35"
        assert probe.read().temperature_degc == pytest.approx(35.0, abs=0.01)
        assert emulated.type("probe unplugged") == "probe (modbus_temperature): unplugged"
        with pytest.raises(DriverError):
            probe.read()

"""Drivers by name."""

import importlib
import subprocess
import sys
from pathlib import Path

import pytest

from drivers import devices, registry
from drivers.devices.mock_robot import MockRobot
from drivers.devices.mock_stage import MockStageSensor
from drivers.devices.mock_tracker import MockTracker
from drivers.errors import DriverError

PLACES = (
    registry.ROBOTS,
    registry.TRACKERS,
    registry.STAGE_SENSORS,
    registry.TEMPERATURE_PROBES,
)
ENTRIES = [entry for drivers in PLACES for entry in drivers.values()]


def test_a_driver_is_made_by_its_name():
    assert isinstance(registry.open_robot("mock", "127.0.0.1:1", 6), MockRobot)
    assert isinstance(registry.open_tracker("mock", "127.0.0.1:1"), MockTracker)
    assert isinstance(registry.open_stage_sensor("mock", "127.0.0.1:1", "rod"), MockStageSensor)


@pytest.mark.parametrize(
    ("open_device", "names"),
    [
        (lambda: registry.open_robot("fanuc", "x", 6), registry.ROBOTS),
        (lambda: registry.open_tracker("faro", "x"), registry.TRACKERS),
        (lambda: registry.open_stage_sensor("ruler", "x", "rod"), registry.STAGE_SENSORS),
        (lambda: registry.open_temperature_probe("hand", "x"), registry.TEMPERATURE_PROBES),
    ],
)
def test_an_unknown_name_is_answered_with_the_known_ones(open_device, names):
    with pytest.raises(DriverError) as caught:
        open_device()
    for name in names:
        assert name in str(caught.value)


def test_every_device_module_is_registered():
    folder = Path(devices.__path__[0])
    present = {entry.stem for entry in folder.iterdir() if entry.stem.strip("_") == entry.stem}
    assert present == {entry.partition(":")[0].rpartition(".")[2] for entry in ENTRIES}


@pytest.mark.parametrize("entry", sorted(ENTRIES))
def test_every_entry_names_a_class_that_exists(entry):
    module, _, name = entry.partition(":")
    assert isinstance(getattr(importlib.import_module(module), name), type)


def test_choosing_one_driver_loads_no_other_drivers_library():
    program = (
        "import sys; from drivers.registry import open_robot; open_robot('mock', 'h:1', 6); "
        "libraries = {'rtde_control', 'rtde_receive', 'geocompy', 'pymodbus', 'ndicapy'}; "
        "print(sorted(libraries & set(sys.modules)))"
    )
    loaded = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert loaded.stdout.strip() == "[]"


def test_a_missing_client_library_is_named(tmp_path, monkeypatch):
    (tmp_path / "exotic_device.py").write_text("import exotic_vendor_library\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(registry.ROBOTS, "exotic", "exotic_device:Exotic")
    with pytest.raises(DriverError, match="exotic_vendor_library is not installed"):
        registry.open_robot("exotic", "here", 6)

"""The emulated GeoCOM station: its bytes on its own, then driver and station together."""

import math
import os
import re
import select
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from geocom_cell import TARGET, geocom_cell

from drivers.devices.geocom import GeoComTracker
from drivers.errors import BadReply, NoReply, Refused, Unreachable
from drivers.interfaces import FixedNest, TurningTracker
from drivers.registry import open_tracker

TRANSCRIPTS = Path(__file__).parents[1] / "drivers" / "transcripts"


@pytest.fixture(autouse=True)
def _no_second_of_waiting(monkeypatch):
    """`geocompy` sleeps a fixed second after its first exchange."""
    monkeypatch.setattr("geocompy.geo.sleep", lambda _: None)


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    with geocom_cell(tmp_path_factory.mktemp("geocom")) as cell:
        yield cell


@pytest.fixture
def cell(running):
    running.station.order(fault="none")
    running.set("beam_blocked", False)
    return running


@pytest.fixture
def tracker(cell):
    connected = GeoComTracker(cell.station.port, reply_timeout_s=0.3, measure_timeout_s=0.5)
    connected.connect()
    yield connected
    connected.close()


def receive_line(port: int) -> bytes:
    line = b""
    while not line.endswith(b"\r\n"):
        assert select.select([port], [], [], 5)[0], f"only {line!r} came"
        line += os.read(port, 1)
    return line


@pytest.mark.parametrize("name", ["geocom_manual.txt", "geocom_session.txt"])
def test_the_station_answers_byte_for_byte(tmp_path, name):
    with geocom_cell(tmp_path) as fresh:
        port = os.open(fresh.station.port, os.O_RDWR | os.O_NOCTTY)
        request = None
        for line in (TRANSCRIPTS / name).read_bytes().splitlines():
            if line.startswith(b">"):
                request = line[2:]
                os.write(port, request + b"\r\n")
            elif line.startswith(b"<"):
                pattern = re.escape(line[2:] + b"\r\n").replace(rb"\{time\}", rb"\d+")
                assert re.fullmatch(pattern, receive_line(port)), request
        os.close(port)


def test_a_measurement_is_the_worlds(tracker):
    reading = tracker.measure()
    # The station rounds the distance to 1e-9 m.
    assert reading.position == pytest.approx(TARGET, abs=2e-9)
    assert reading.shots == 3
    assert reading.spread < 1e-9


@pytest.mark.parametrize("point_mm", [(-900, 2000, -700), (-5, -1500, 10), (3000, -1, 1)])
def test_every_direction_is_measured_right(tmp_path, point_mm):
    base = {"xyz_mm": point_mm, "ypr_deg": [0, 0, 0]}
    with geocom_cell(tmp_path, base=base) as cell:
        station = GeoComTracker(cell.station.port, shots=1)
        station.connect()
        position = station.measure().position
        station.close()
    np.testing.assert_allclose(np.array(position) * 1e3, point_mm, atol=2e-6)


def test_the_spread_tells_the_noise(tmp_path):
    noise = {"position_mm": 0.3, "ppm": 0, "orientation_mrad": 0}
    with geocom_cell(tmp_path, noise=noise, time_scale=1000) as cell:
        station = GeoComTracker(cell.station.port, shots=60)
        station.connect()
        reading = station.measure()
        station.close()
    # The largest of three standard deviations of 60 shots each.
    assert reading.spread == pytest.approx(0.3e-3, rel=0.35)
    assert math.dist(reading.position, TARGET) < 5 * 0.3e-3 / math.sqrt(60) * math.sqrt(3)


def test_it_turns_to_a_fixed_nest_and_back_to_the_target(tracker):
    assert isinstance(tracker, TurningTracker)
    assert tracker.measure().position == pytest.approx(TARGET, abs=2e-9)
    seen = tracker.measure_fixed(FixedNest("r1", (-0.802, 1.5, -0.3)))
    assert seen.position == pytest.approx((-0.8, 1.5, -0.3), abs=2e-9)
    assert tracker.measure().position == pytest.approx(TARGET, abs=2e-9)


def test_a_blocked_beam_is_refused_and_seen_again(cell, tracker):
    cell.set("beam_blocked", True)
    with pytest.raises(Refused, match="line of sight"):
        tracker.measure()
    cell.set("beam_blocked", False)
    assert tracker.measure().position == pytest.approx(TARGET, abs=2e-9)


@pytest.mark.parametrize(
    "fault",
    [
        {"fault": "silence"},
        {"fault": "silence", "rpc": 17017},
        {"fault": "cut_reply", "rpc": 17017},
        {"fault": "wrong_checksum"},
        {"fault": "wrong_checksum", "rpc": 17017, "replies": 2},
        {"fault": "noise", "rpc": 17017},
        {"fault": "wrong_id", "rpc": 17017},
        # The reply before once more: it bears an earlier transaction's number.
        {"fault": "frozen", "rpc": 17017},
        # Late by more than the driver waits: the reply comes while the next one is awaited.
        {"fault": "late_reply", "delay_s": 0.6},
        {"fault": "late_reply", "delay_s": 0.85, "rpc": 17017},
    ],
    ids=lambda fault: "_".join(str(value) for value in fault.values()),
)
def test_a_fault_of_the_line_is_overcome(cell, tracker, fault):
    assert cell.station.order(**fault)["ok"]
    assert tracker.measure().position == pytest.approx(TARGET, abs=2e-9)
    assert tracker.measure().position == pytest.approx(TARGET, abs=2e-9)


@pytest.mark.parametrize(
    ("fault", "error"),
    [
        ({"fault": "silence", "replies": 3}, NoReply),
        ({"fault": "wrong_checksum", "replies": 3}, BadReply),
        ({"fault": "frozen", "replies": 3}, NoReply),
        ({"fault": "wrong_id", "replies": 3}, NoReply),
        ({"fault": "code", "code": 1285, "rpc": 17017}, Refused),
    ],
)
def test_a_fault_that_lasts_is_told_and_forgotten_when_it_is_over(cell, tracker, fault, error):
    cell.station.order(**fault)
    with pytest.raises(error):
        tracker.measure()
    assert tracker.measure().position == pytest.approx(TARGET, abs=2e-9)


def test_a_station_that_is_switched_off_is_unreachable(tmp_path):
    with geocom_cell(tmp_path) as cell:
        station = GeoComTracker(cell.station.port, measure_timeout_s=0.5)
        station.connect()
        assert cell.station.end() == 0
        with pytest.raises(Unreachable, match="check the cable"):
            station.measure()
        with pytest.raises(Unreachable):
            station.connect()
        station.close()


def test_unplugged_is_unreachable_and_works_again_when_it_is_back(tmp_path):
    with geocom_cell(tmp_path, "--link", str(tmp_path / "port")) as cell:
        station = GeoComTracker(cell.station.port, measure_timeout_s=0.5)
        station.connect()
        cell.station.order(fault="unplugged")
        with pytest.raises(Unreachable, match="check the cable"):
            station.measure()
        with pytest.raises(Unreachable, match="does not open"):
            station.connect()
        cell.station.order(fault="plugged")
        station.connect()
        assert station.measure().position == pytest.approx(TARGET, abs=2e-9)
        station.close()


def test_a_wrong_speed_is_told_with_the_speed(cell):
    station = GeoComTracker(f"{cell.station.port}?baud=9600", reply_timeout_s=0.3)
    with pytest.raises(NoReply, match="9600 baud"):
        station.connect()
    station.close()


def test_a_port_in_use_is_unreachable_for_a_second_program(cell, tracker):
    second = GeoComTracker(cell.station.port)
    with pytest.raises(Unreachable, match="no other program"):
        second.connect()
    assert tracker.measure().shots == 3


def test_a_link_names_the_port_and_goes_with_the_station(tmp_path):
    link = tmp_path / "total-station"
    with geocom_cell(tmp_path, "--link", str(link)) as cell:
        assert cell.station.port == str(link)
        station = open_tracker("geocom", str(link))
        station.connect()
        assert station.measure().position == pytest.approx(TARGET, abs=2e-9)
        station.close()
    assert not link.is_symlink()


def test_the_station_ends_when_the_world_ends(tmp_path):
    with geocom_cell(tmp_path) as cell:
        station = GeoComTracker(cell.station.port, reply_timeout_s=0.3, measure_timeout_s=0.3)
        station.connect()
        cell.world.end()
        with pytest.raises((NoReply, Unreachable)):
            station.measure()
        assert cell.station.process.wait(5) == 1
        station.close()


def test_a_fault_that_is_not_known_is_refused(cell):
    refused = cell.station.order(fault="fire")
    assert not refused["ok"]
    assert "late_reply" in refused["message"]


def test_measuring_takes_the_worlds_time(tmp_path):
    with geocom_cell(tmp_path, time_scale=2) as cell:
        station = GeoComTracker(cell.station.port, shots=1)
        station.connect()
        began = time.monotonic()
        station.measure()
        took = time.monotonic() - began
        station.close()
    # Half a second to aim and 0.3 s to measure, at twice our speed.
    assert took >= 0.4
    assert threading.active_count() == 1

"""The emulated NDI sensor: its bytes on its own, then the real client library with it."""

import math
import os
import re
import signal
from pathlib import Path

import numpy as np
import pytest
from geocom_cell import TARGET
from instrument_cell import exchange_bytes, instrument_cell
from ur_cell import wait_until

from drivers.devices.ndi import NdiTracker
from drivers.errors import BadReply, NoReply, Refused, Unreachable
from drivers.registry import open_tracker

RESOLUTION = 1.5e-7
"""Of a float32 in millimetres at 2.4 m [m]."""


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    with instrument_cell(tmp_path_factory.mktemp("ndi"), "ndi_camera") as cell:
        yield cell


@pytest.fixture
def cell(running):
    running.station.order(fault="plugged")
    running.station.order(fault="none")
    running.set("beam_blocked", False)
    return running


@pytest.fixture
def tracker(cell):
    camera = NdiTracker(cell.station.port, shots=1)
    camera.connect()
    yield camera
    camera.close()


def must_see_the_target(tracker: NdiTracker) -> None:
    assert tracker.measure().position == pytest.approx(TARGET, abs=RESOLUTION)


def test_the_sensor_answers_as_in_the_guide(tmp_path):
    with instrument_cell(tmp_path, "ndi_camera", "--tools", "2") as cell:
        for command, reply in [
            (rb"INIT:E3A5", rb"OKAYA896"),
            (rb"PHSR:02[0-9A-F]{4}", rb"020100102001[0-9A-F]{4}"),
            (rb"TSTART ", rb"OKAYA896"),
            (rb"TX:0001031A", rb"00" + rb"0000[0-9A-F]{4}"),
            (rb"TSTOP ", rb"OKAYA896"),
            (rb"PINIT 01", rb"OKAYA896"),
            (rb"PINIT 02", rb"OKAYA896"),
            (rb"PENA 01D", rb"OKAYA896"),
            (rb"PENA 02D", rb"OKAYA896"),
            (rb"TSTART ", rb"OKAYA896"),
            # Hundredths of a millimetre, 1e-4 of a quaternion; the other tool is missing.
            (
                rb"TX:0001031A",
                rb"0201\+10000\+00000\+00000\+00000\+123457\+234568\+045679\+00000"
                rb"00000031[0-9A-F]{8}\n02MISSING00000031[0-9A-F]{8}\n0000[0-9A-F]{4}",
            ),
            (rb"FLY", rb"ERROR01[0-9A-F]{4}"),
            (rb"INIT:E3A6", rb"ERROR04[0-9A-F]{4}"),
        ]:
            sent = command.replace(rb"[0-9A-F]{4}", b"")
            if sent != command:
                sent = b"PHSR 02"
            received = exchange_bytes(cell.station.port, 9600, sent + b"\r", 1)
            assert re.fullmatch(reply + rb"\r", received), command


def test_a_measurement_is_the_worlds_with_its_orientation(tmp_path):
    base = {"xyz_mm": [-300.0, 200.0, -1500.0], "ypr_deg": [90.0, 0.0, 0.0]}
    noise = {"position_mm": 0.3, "ppm": 0, "orientation_mrad": 1.0}
    with instrument_cell(tmp_path, "ndi_camera", base=base, noise=noise) as cell:
        camera = open_tracker("ndi", cell.station.port)
        camera.connect()
        readings = [camera.measure() for _ in range(2)]
        camera.close()
    for reading in readings:
        assert reading.shots == 10
        # Ten shots of 0.3 mm and 1 mrad an axis; five standard deviations of their mean.
        place = np.array(base["xyz_mm"]) * 1e-3
        np.testing.assert_allclose(reading.position, place, atol=5 * 0.3e-3 / math.sqrt(10))
        half = math.sqrt(0.5)
        np.testing.assert_allclose(
            reading.orientation, (half, 0, 0, half), atol=5 * 0.5e-3 / math.sqrt(10)
        )
        assert 0.1e-3 < reading.spread < 0.8e-3


@pytest.mark.parametrize("kind", ["silence", "cut_reply", "noise", "wrong_checksum", "late_reply"])
def test_a_fault_of_the_line_is_overcome(cell, tracker, kind):
    cell.station.order(fault=kind, delay_s=0.3 if kind == "late_reply" else 0.0)
    must_see_the_target(tracker)
    must_see_the_target(tracker)


def test_a_wrong_checksum_that_lasts_is_a_bad_reply(cell, tracker):
    # At the start of a new child the first reply, to TSTOP, may be an error and is passed over.
    cell.station.order(fault="wrong_checksum", replies=100)
    with pytest.raises(BadReply, match="checksum is wrong; check the cable"):
        tracker.measure()
    cell.station.order(fault="none")
    must_see_the_target(tracker)


def test_one_frame_that_comes_again_is_not_taken_twice(cell, tracker):
    must_see_the_target(tracker)
    cell.station.order(fault="frozen", replies=20)
    must_see_the_target(tracker)


def test_silence_that_lasts_is_told_and_forgotten_when_it_is_over(cell):
    tracker = NdiTracker(cell.station.port, shots=1, connect_deadline_s=1.0)
    tracker.connect()
    cell.station.order(fault="silence", replies=100)
    with pytest.raises(NoReply, match="check that the sensor is on"):
        tracker.measure()
    assert tracker.child_pid is None
    cell.station.order(fault="none")
    must_see_the_target(tracker)
    tracker.close()


def test_frames_that_stand_still_are_no_reading(cell):
    tracker = NdiTracker(cell.station.port, shots=1, connect_deadline_s=1.0)
    tracker.connect()
    must_see_the_target(tracker)
    cell.station.order(fault="frozen", replies=100_000)
    with pytest.raises(NoReply):
        tracker.measure()
    cell.station.order(fault="none")
    must_see_the_target(tracker)
    tracker.close()


@pytest.mark.parametrize("kind", ["missing", "disabled", "wrong_id"])
def test_a_tool_that_is_not_there_is_refused_and_seen_again(cell, tracker, kind):
    cell.station.order(fault=kind, replies=100_000)
    with pytest.raises(Refused, match="missing" if kind == "missing" else "disabled"):
        tracker.measure()
    cell.station.order(fault="none")
    must_see_the_target(tracker)


def test_a_blocked_view_is_a_missing_tool(cell, tracker):
    cell.set("beam_blocked", True)
    with pytest.raises(Refused, match="clear the line of sight"):
        tracker.measure()


def test_an_error_code_is_refused_with_advice_and_not_asked_again(cell, tracker):
    cell.station.order(fault="code", code=0x10, replies=2)
    with pytest.raises(Refused, match="error 10, the sensor is not initialised"):
        tracker.measure()
    must_see_the_target(tracker)


def test_unplugged_is_unreachable_and_works_again_when_it_is_back(cell, tracker):
    cell.station.order(fault="unplugged")
    for _ in range(2):
        with pytest.raises(Unreachable, match="cable"):
            tracker.measure()
    cell.station.order(fault="plugged")
    must_see_the_target(tracker)


def test_a_killed_child_is_replaced(cell, tracker):
    os.kill(tracker.child_pid, signal.SIGKILL)
    must_see_the_target(tracker)


def test_closing_leaves_no_process(cell, tracker):
    process = Path(f"/proc/{tracker.child_pid}")
    assert process.exists()
    tracker.close()
    wait_until(lambda: not process.exists())


def test_a_port_in_use_is_unreachable(cell, tracker):
    with pytest.raises(Unreachable, match="no other program"):
        NdiTracker(cell.station.port).connect()
    must_see_the_target(tracker)


def test_a_tool_that_is_not_plugged_in_is_refused(cell):
    with pytest.raises(Refused, match="there are 1 tools and number 2 is wanted"):
        NdiTracker(f"{cell.station.port}?tool=2").connect()


def test_a_sensor_at_another_speed_is_told(tmp_path):
    with instrument_cell(tmp_path, "ndi_camera", "--baud", "115200") as cell:
        camera = NdiTracker(cell.station.port, connect_deadline_s=1.0)
        with pytest.raises(NoReply, match="speed"):
            camera.connect()
        assert camera.child_pid is None


def test_a_passive_tool_is_loaded_from_its_file(tmp_path):
    rom = tmp_path / "tool.rom"
    rom.write_bytes(b"NDI" + bytes(749))
    with instrument_cell(tmp_path, "ndi_camera", "--tools", "0") as cell:
        camera = NdiTracker(f"{cell.station.port}?rom={rom}", shots=1)
        camera.connect()
        must_see_the_target(camera)
        camera.close()
        with pytest.raises(Refused, match="there is no tool file"):
            NdiTracker(f"{cell.station.port}?rom={tmp_path / 'other.rom'}").connect()

"""A relayed tracker, triggered and streamed, with every fault of its line."""

import math
from contextlib import suppress

import numpy as np
import pytest
from geocom_cell import POST, TARGET
from instrument_cell import exchange_bytes, instrument_cell
from ur_cell import wait_until

from drivers.devices.relay import RelayTracker
from drivers.errors import BadReply, NoReply, Refused, Unreachable
from drivers.registry import open_tracker

FORMS = ["triggered_6d", "streamed_3d"]
TIMEOUT_S = 0.25


class Running:
    def __init__(self, cell, form: str) -> None:
        self.cell = cell
        self.form = form
        self.address = f"{cell.station.port}?profile=relay_{form}"

    def tracker(self, **options) -> RelayTracker:
        return RelayTracker(self.address, **{"shots": 1, "reply_timeout_s": TIMEOUT_S, **options})

    def fault(self, kind: str, **order) -> None:
        assert self.cell.station.order(fault=kind, **order)["ok"]


@pytest.fixture(scope="module", params=FORMS)
def started(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    with instrument_cell(folder, "relay_host", "--form", request.param) as cell:
        yield Running(cell, request.param)


@pytest.fixture
def one(started):
    started.fault("plugged")
    started.fault("none")
    started.cell.set("beam_blocked", False)
    return started


@pytest.fixture
def tracker(one):
    made = one.tracker()
    made.connect()
    yield made
    made.close()


def must_see_the_target(tracker: RelayTracker) -> None:
    # Four decimals of a millimetre, seven of a metre.
    assert tracker.measure().position == pytest.approx(TARGET, abs=0.6e-7)


def test_a_measurement_is_the_worlds(one):
    tracker = open_tracker("relay", one.address)
    tracker.connect()
    reading = tracker.measure()
    tracker.close()
    assert reading.position == pytest.approx(TARGET, abs=0.6e-7)
    assert reading.shots == 3
    assert reading.spread == 0.0
    if one.form == "triggered_6d":
        assert reading.orientation == pytest.approx((1, 0, 0, 0), abs=1e-9)
    else:
        assert reading.orientation is None


@pytest.mark.parametrize("kind", ["silence", "cut_reply", "noise"])
def test_a_fault_of_the_line_is_overcome(one, tracker, kind):
    one.fault(kind)
    must_see_the_target(tracker)
    must_see_the_target(tracker)


@pytest.mark.parametrize(
    ("kind", "error"), [("silence", NoReply), ("cut_reply", BadReply), ("noise", BadReply)]
)
def test_a_fault_that_lasts_is_told_and_forgotten_when_it_is_over(one, tracker, kind, error):
    one.fault(kind, replies=100_000)
    with pytest.raises((error, BadReply)) as caught:
        tracker.measure()
    assert "relay" in caught.value.device
    assert "check" in caught.value.reason
    one.fault("none")
    must_see_the_target(tracker)


def test_a_measurement_that_is_old_is_never_used(one, tracker):
    must_see_the_target(tracker)
    one.fault("frozen", replies=100_000)
    with pytest.raises((NoReply, BadReply)) as caught:
        tracker.measure()
    assert caught.value.raw
    one.fault("none")
    must_see_the_target(tracker)


def test_a_host_that_stands_still_is_not_there_for_a_new_driver_either(one, tracker):
    must_see_the_target(tracker)
    tracker.close()
    one.fault("frozen", replies=100_000)
    fresh = one.tracker()
    try:
        with pytest.raises((NoReply, BadReply)):
            fresh.connect()
    finally:
        fresh.close()


def test_an_error_of_the_host_is_refused_with_advice(one, tracker):
    one.fault("code", replies=100_000)
    with pytest.raises(Refused, match=r"warms up|look it up") as caught:
        tracker.measure()
    assert caught.value.raw
    one.fault("none")
    must_see_the_target(tracker)


def test_a_broken_beam_is_refused_and_seen_again(one, tracker):
    one.cell.set("beam_blocked", True)
    with pytest.raises(Refused, match="clear the line of sight"):
        tracker.measure()
    one.cell.set("beam_blocked", False)
    must_see_the_target(tracker)


def test_unplugged_is_unreachable_and_works_again_when_it_is_back(one, tracker):
    one.fault("unplugged")
    for _ in range(2):
        with pytest.raises(Unreachable, match="cable"):
            tracker.measure()
    one.fault("plugged")
    must_see_the_target(tracker)


def test_a_port_in_use_is_unreachable(one, tracker):
    with pytest.raises(Unreachable, match="no other program"):
        one.tracker().connect()
    must_see_the_target(tracker)


def test_a_wrong_profile_is_told_with_the_line(one):
    other = next(form for form in FORMS if form != one.form)
    tracker = RelayTracker(
        f"{one.cell.station.port}?profile=relay_{other}", reply_timeout_s=TIMEOUT_S
    )
    with pytest.raises((BadReply, NoReply), match="check"):
        tracker.connect()
    tracker.close()


@pytest.fixture(scope="module")
def triggered(tmp_path_factory):
    with instrument_cell(tmp_path_factory.mktemp("triggered"), "relay_host") as cell:
        yield Running(cell, "triggered_6d")


@pytest.mark.parametrize("kind", ["wrong_checksum", "wrong_id", "late_reply"])
def test_faults_of_a_triggered_line_are_overcome(triggered, kind):
    tracker = triggered.tracker()
    tracker.connect()
    triggered.fault(kind, delay_s=0.4 if kind == "late_reply" else 0.0)
    must_see_the_target(tracker)
    must_see_the_target(tracker)
    tracker.close()


def test_a_late_line_is_never_the_next_measurement(tmp_path):
    """Each line bears the number of its trigger, however late it is."""
    arm = POST.replace("a_mm: 0", "a_mm: 100")
    with instrument_cell(tmp_path, "relay_host", robot=arm) as cell:
        tracker = Running(cell, "triggered_6d").tracker(reply_timeout_s=0.15)
        tracker.connect()
        cell.station.order(fault="late_reply", delay_s=0.7, replies=3)
        with pytest.raises((NoReply, BadReply)):
            tracker.measure()
        cell.move([0.5])
        measured = []
        wait_until(lambda: bool(measured) or measured_one(tracker, measured))
        tracker.close()
    turned = (TARGET[0] + 0.1 * math.cos(0.5), TARGET[1] + 0.1 * math.sin(0.5), TARGET[2])
    assert measured[0].position == pytest.approx(turned, abs=0.6e-7)


def measured_one(tracker: RelayTracker, measured: list) -> bool:
    with suppress(NoReply, BadReply):
        measured.append(tracker.measure())
    return bool(measured)


def test_a_wrong_speed_is_told_with_the_speed(triggered):
    tracker = RelayTracker(f"{triggered.cell.station.port}?baud=9600", reply_timeout_s=TIMEOUT_S)
    with pytest.raises(BadReply, match=r"9600 baud|cable, speed"):
        tracker.connect()
    tracker.close()


def test_the_host_answers_as_its_form_says(triggered):
    line = exchange_bytes(triggered.cell.station.port, 115200, b"M 17\r\n", 1)
    body = b"LT,17,1234.5670,2345.6780,456.7890,1.000000000,0.000000000,0.000000000,0.000000000"
    check = int(np.bitwise_xor.reduce(np.frombuffer(body, np.uint8)))
    assert line == b"$" + body + b"*%02X\r\n" % check


def test_several_lines_are_averaged_with_their_spread(tmp_path):
    noise = {"position_mm": 0.3, "ppm": 0, "orientation_mrad": 1.0}
    with instrument_cell(tmp_path, "relay_host", noise=noise) as cell:
        tracker = Running(cell, "triggered_6d").tracker(shots=60)
        tracker.connect()
        reading = tracker.measure()
        tracker.close()
    # The largest of three standard deviations of 60 shots each.
    assert reading.spread == pytest.approx(0.3e-3, rel=0.35)
    assert math.dist(reading.position, TARGET) < 5 * 0.3e-3 / math.sqrt(60) * math.sqrt(3)
    np.testing.assert_allclose(reading.orientation, (1, 0, 0, 0), atol=5 * 0.5e-3 / math.sqrt(60))

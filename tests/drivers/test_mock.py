"""The mock drivers against a real emulated world, and against replies that none would send."""

import socket
import threading

import numpy as np
import pytest
from scripted_server import scripted_server
from world_process import world

from drivers.devices import mock_robot
from drivers.devices.mock_robot import MockRobot
from drivers.devices.mock_stage import MockStageSensor
from drivers.devices.mock_temperature import MockTemperature
from drivers.devices.mock_tracker import MockTracker
from drivers.errors import BadReply, Interrupted, NoReply, Refused, Unreachable, Unsafe
from drivers.interfaces import FixedNest, JointMotion, Safety, TurningTracker

TARGET = (0.5, -1.0, 1.0, -0.3, 0.2, 0.1)
HELLO = b'{"ok": true, "n_joints": 6, "time_scale": 1}\n'
STANDING = (
    b'{"ok": true, "joints": [0, 0, 0, 0, 0, 0], "moving": false, "safety": "normal", '
    b'"time_s": 1}\n'
)


def motion(joints=TARGET, speed=1.0, deadline_s=10.0) -> JointMotion:
    return JointMotion(joints, speed, 4.0, deadline_s)


def always() -> bool:
    return True


def resting_place(cell) -> list[float]:
    """Where the robot comes to rest by itself."""
    while cell.ask("robot")["moving"]:
        pass
    return cell.ask("robot")["joints"]


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    with world(tmp_path_factory.mktemp("world"), stage={"slide": 0.25}) as cell:
        yield cell


@pytest.fixture
def cell(running):
    """The world, safe and in sight, its robot standing at zero, 10 times as fast as we."""
    running.set("safety", "normal")
    running.set("beam_blocked", False)
    running.ask("stop", acceleration=1000.0)
    running.set("time_scale", 1000.0)
    running.move_and_wait([0.0] * 6)
    running.set("time_scale", 10.0)
    return running


@pytest.fixture
def robot(cell):
    connected = MockRobot(cell.address, 6)
    connected.connect()
    yield connected
    connected.close()


def test_a_move_ends_at_the_target(cell, robot):
    robot.move(motion(), always)
    state = robot.state()
    assert state.joints == TARGET
    assert not state.moving
    assert state.safety is Safety.normal
    assert state.advice == ""
    assert tuple(cell.ask("robot")["joints"]) == TARGET


def test_the_caller_is_asked_at_least_every_50_ms_while_the_robot_moves(cell, robot):
    times = []

    def noting() -> bool:
        times.append(cell.ask("hello")["time_s"])
        return True

    robot.move(motion(), noting)
    # 1 rad at 1 rad/s and 4 rad/s2 takes 1.25 s of the world's time; 0.5 s of it are 50 ms here.
    # The median, because the machine may be busy with other things now and then.
    assert times[-1] - times[0] > 1.0
    assert np.median(np.diff(times)) < 0.5


def test_a_motion_that_is_no_longer_wanted_stops_the_robot(cell, robot):
    answers = iter([True, True, False])
    with pytest.raises(Interrupted):
        robot.move(motion(speed=0.2), lambda: next(answers))
    assert abs(resting_place(cell)[1]) < 0.9


def test_a_motion_past_its_deadline_stops_the_robot(cell, robot):
    with pytest.raises(NoReply, match="not arrived"):
        robot.move(motion(speed=0.2, deadline_s=0.1), always)
    assert abs(resting_place(cell)[1]) < 0.9


def test_a_robot_that_may_not_move_is_not_moved(cell, robot):
    cell.set("safety", "protective_stop")
    assert robot.state().advice
    with pytest.raises(Unsafe, match="protective_stop"):
        robot.move(motion(), always)
    assert cell.ask("robot")["joints"] == [0.0] * 6


def test_a_protective_stop_during_a_motion_is_told(cell, robot):
    def stop_on_the_way() -> bool:
        if abs(cell.ask("robot")["joints"][1]) > 0.2:
            cell.set("safety", "protective_stop")
        return True

    with pytest.raises(Unsafe, match="protective_stop"):
        robot.move(motion(speed=0.5), stop_on_the_way)


def test_a_robot_stopped_by_something_else_has_not_arrived(cell, robot):
    def stop_on_the_way() -> bool:
        if abs(cell.ask("robot")["joints"][1]) > 0.2:
            cell.ask("stop", acceleration=100.0)
        return True

    with pytest.raises(Unsafe, match="away from the target"):
        robot.move(motion(speed=0.5), stop_on_the_way)


def test_a_target_outside_the_limits_is_refused(robot):
    with pytest.raises(Refused, match="Joint 2"):
        robot.move(motion((0, 7, 0, 0, 0, 0)), always)


def test_closing_stops_a_moving_robot(cell):
    driver = MockRobot(cell.address, 6)
    driver.connect()
    cell.ask("move", joints=list(TARGET), speed=0.1, acceleration=4.0)
    driver.close()
    assert abs(resting_place(cell)[1]) < 0.9


def test_closing_twice_or_before_connecting_is_harmless(cell):
    driver = MockRobot(cell.address, 6)
    driver.close()
    driver.connect()
    driver.close()
    driver.close()


def test_a_driver_that_was_not_connected_says_so(cell):
    with pytest.raises(Unreachable, match="call connect"):
        MockRobot(cell.address, 6).state()


def test_a_model_with_another_number_of_joints_is_refused(cell):
    driver = MockRobot(cell.address, 7)
    with pytest.raises(Refused, match="6 joints, the cell's model has 7"):
        driver.connect()
    driver.close()


def test_a_full_pose_is_measured(cell):
    tracker = MockTracker(cell.address)
    tracker.connect()
    reading = tracker.measure()
    truth = cell.ask("truth")
    tracker.close()
    # Six standard deviations of the default instrument at less than 5 m.
    assert np.abs(np.subtract(reading.position, truth["position"])).max() < 6 * 45e-6
    assert abs(np.dot(reading.orientation, truth["orientation"])) > 1 - 1e-6
    assert (reading.shots, reading.spread) == (1, 0.0)


def test_a_blocked_beam_is_refused_with_advice(cell):
    tracker = MockTracker(cell.address)
    tracker.connect()
    cell.set("beam_blocked", True)
    with pytest.raises(Refused, match="line of sight"):
        tracker.measure()
    tracker.close()


def test_a_stage_sensor_is_read(cell):
    sensor = MockStageSensor(cell.address, "slide")
    sensor.connect()
    assert sensor.read().value == 0.25
    sensor.close()


def test_a_sensor_that_the_stage_lacks_is_refused(cell):
    sensor = MockStageSensor(cell.address, "rod")
    with pytest.raises(Refused, match="rod"):
        sensor.connect()
    sensor.close()


def test_nobody_at_the_address_is_unreachable():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    with pytest.raises(Unreachable, match=f"127.0.0.1:{port}"):
        MockRobot(f"127.0.0.1:{port}", 6).connect()


@pytest.mark.parametrize("address", ["", "here", "127.0.0.1", ":1", "127.0.0.1:0", "h:70000"])
def test_an_address_of_another_form_is_unreachable(address):
    with pytest.raises(Unreachable, match="host:port"):
        MockTracker(address).connect()


@pytest.mark.parametrize(
    ("reply", "reason"),
    [
        (b"hello\n", "not JSON"),
        (b"[1]\n", "not a JSON object"),
        (b'{"ok": 1}\n', "field ok"),
        (b'{"ok": true, "joints": "no"}\n', "field safety"),
        (b'{"ok": true, "safety": "fine"}\n', "'fine' is unknown"),
        (STANDING.replace(b"[0, 0, 0, 0, 0, 0]", b"[0, null]"), "field joints"),
        (STANDING.replace(b"false", b"0"), "field moving"),
    ],
)
def test_a_reply_that_means_nothing_is_a_bad_reply_after_three_attempts(reply, reason):
    with scripted_server(HELLO, reply, reply, reply, STANDING, STANDING) as address:
        driver = MockRobot(address, 6)
        driver.connect()
        with pytest.raises(BadReply, match=reason):
            driver.state()
        assert driver.state().joints == (0.0,) * 6
        driver.close()


@pytest.mark.parametrize("broken", [None, b"nonsense\n"])
def test_a_read_is_repeated_after_a_broken_reply(broken):
    with scripted_server(HELLO, broken, STANDING, STANDING) as address:
        driver = MockRobot(address, 6)
        driver.connect()
        assert driver.state().joints == (0.0,) * 6
        driver.close()


def test_silence_is_no_reply(monkeypatch):
    monkeypatch.setattr(mock_robot, "REPLY_TIMEOUT_S", 0.05)
    with scripted_server(HELLO) as address:
        driver = MockRobot(address, 6)
        driver.connect()
        with pytest.raises(NoReply, match=r"no reply within 0\.05 s"):
            driver.state()
        with pytest.raises(NoReply):
            driver.close()


def test_a_move_whose_answer_is_lost_is_not_sent_again(monkeypatch):
    monkeypatch.setattr(mock_robot, "REPLY_TIMEOUT_S", 0.5)
    stopped = b'{"ok": true}\n'
    with scripted_server(HELLO, STANDING, None, stopped, STANDING) as address:
        driver = MockRobot(address, 6)
        driver.connect()
        with pytest.raises(NoReply, match="move"):
            driver.move(motion(), always)
        driver.close()


def test_the_last_words_of_a_cut_connection_are_reported():
    replies = [HELLO, b'{"ok": tr', b'{"ok": tr', b'{"ok": tr']
    listener = socket.create_server(("127.0.0.1", 0))

    def serve() -> None:
        for reply in replies:
            connection, _ = listener.accept()
            with connection, connection.makefile("rb") as lines:
                for _ in lines:
                    connection.sendall(reply)
                    if reply != HELLO:
                        break

    thread = threading.Thread(target=serve)
    thread.start()
    driver = MockTracker(f"127.0.0.1:{listener.getsockname()[1]}")
    driver.connect()
    driver._line.drop()
    with pytest.raises(NoReply, match="connection lost") as caught:
        driver.measure()
    driver.close()
    thread.join()
    listener.close()
    assert caught.value.raw == b'{"ok": tr'


def test_a_fixed_nest_is_measured_wherever_the_robot_stands(tmp_path):
    with world(tmp_path, nests={"r1": [2000, -300, 500]}) as cell:
        tracker = MockTracker(cell.address)
        tracker.connect()
        assert isinstance(tracker, TurningTracker)
        seen = tracker.measure_fixed(FixedNest("r1", (2.0, -0.3, 0.5)))
        assert seen.position == pytest.approx((2.0, -0.3, 0.5), abs=2e-4)
        with pytest.raises(Refused, match="No nest 'r2'"):
            tracker.measure_fixed(FixedNest("r2", (2.0, -0.3, 0.5)))
        tracker.close()


def test_a_nest_moves_as_the_station_drifts(tmp_path):
    drift = {"effect": "base_step", "step_mm": [3, 0, 0], "after_readings": 0}
    with world(tmp_path, nests={"r1": [2000, 0, 0]}, effects=[drift]) as cell:
        x, _, _ = cell.ask("measure", target="r1")["position"]
    assert x == pytest.approx(2.003, abs=2e-4)


def test_the_probe_reads_the_temperature_of_the_arm(cell):
    cell.set("temperature_degc", 31.5)
    probe = MockTemperature(cell.address)
    probe.connect()
    assert probe.read().temperature_degc == 31.5
    probe.close()
    cell.set("temperature_degc", None)

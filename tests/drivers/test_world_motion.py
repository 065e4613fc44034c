"""Motion in the emulated world against closed forms of uniformly accelerated motion."""

import math
import socket
import time

import pytest
from world_process import EXACT, PENDULUM, pendulum, world

SAMPLES = 60
SLOW = 2.0
"""World seconds a second, where the robot must be met on its way, on a busy machine too."""


@pytest.fixture(scope="module")
def pendulum_world(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pendulum")
    with world(folder, pendulum(folder), **EXACT, time_scale=10) as running:
        yield running


@pytest.fixture
def arm(pendulum_world):
    """The robot standing at zero, allowed to move."""
    pendulum_world.set("safety", "normal")
    pendulum_world.ask("stop", acceleration=1000.0)
    while pendulum_world.ask("robot")["moving"]:
        pass
    pendulum_world.set("time_scale", 1000.0)
    pendulum_world.move_and_wait([0.0])
    pendulum_world.set("time_scale", 10.0)
    return pendulum_world


def travelled(t: float, distance: float, speed: float, acceleration: float) -> float:
    """Distance after a time, from the three phases: v t / 2, v t, and backwards from the end."""
    ramp = min(speed / acceleration, (distance / acceleration) ** 0.5)
    top = acceleration * ramp
    total = distance / top + ramp
    if t <= ramp:
        return acceleration * t**2 / 2
    if t >= total - ramp:
        return distance - acceleration * max(total - t, 0) ** 2 / 2
    return top * (t - ramp / 2)


@pytest.mark.parametrize(
    ("distance", "speed", "acceleration", "duration"),
    [
        (2.0, 1.0, 2.0, 2.5),  # 2 rad at 1 rad/s and half a second lost in each of two ramps of .5
        (0.32, 1.0, 2.0, 0.8),  # too short to reach the speed: 2 sqrt(0.32 / 2)
    ],
)
def test_a_move_follows_the_trapezoidal_profile(arm, distance, speed, acceleration, duration):
    arm.set("time_scale", SLOW)
    segment = arm.ask("move", joints=[distance], speed=speed, acceleration=acceleration)["segment"]
    assert segment["duration_s"] == pytest.approx(duration)
    moving = 0
    for _ in range(SAMPLES):
        state = arm.ask("robot")
        expected = travelled(state["time_s"] - segment["start_s"], distance, speed, acceleration)
        assert state["joints"][0] == pytest.approx(expected)
        moving += state["moving"]
    assert moving
    while arm.ask("robot")["moving"]:
        pass
    assert arm.ask("robot")["joints"] == [distance]


def test_a_moving_target_is_measured_where_it_is_at_that_moment(arm):
    arm.set("time_scale", SLOW)
    segment = arm.ask("move", joints=[3.0], speed=1.0, acceleration=2.0)["segment"]
    between = 0
    while arm.ask("robot")["moving"]:
        reading = arm.ask("measure")
        angle = travelled(reading["time_s"] - segment["start_s"], 3.0, 1.0, 2.0)
        x, y, _ = reading["position"]
        # The tip of the 1 m rod is at (cos, sin) of the joint angle.
        assert x**2 + y**2 == pytest.approx(1.0)
        if 0.1 < angle < 1.5:
            assert y / x == pytest.approx(math.tan(angle))
            between += 1
    assert between


def test_all_joints_start_and_end_together(tmp_path):
    with world(tmp_path, "ur10e", time_scale=10) as cell:
        target = [1.0, -0.5, 0.25, 0.0, -0.125, 2.0]
        cell.ask("move", joints=target, speed=1.0, acceleration=2.0)
        seen = [cell.ask("robot")["joints"] for _ in range(20)]
    for joints in seen:
        part = joints[5] / 2.0
        assert joints == pytest.approx([part * q for q in target])


def test_a_stop_takes_half_of_speed_squared_over_deceleration(arm):
    arm.set("time_scale", SLOW)
    segment = arm.ask("move", joints=[3.0], speed=1.0, acceleration=10.0)["segment"]
    while arm.ask("robot")["joints"][0] < 0.5:
        pass
    stopping = arm.ask("stop", acceleration=2.0)["segment"]
    began = stopping["start_s"] + stopping["ramp_s"]
    here = travelled(began - segment["start_s"], 3.0, 1.0, 10.0)
    while arm.ask("robot")["moving"]:
        pass
    assert arm.ask("robot")["joints"][0] == pytest.approx(here + 1.0**2 / (2 * 2.0))
    assert stopping["ramp_s"] == pytest.approx(1.0 / 2.0)


def test_a_stop_at_rest_changes_nothing(arm):
    arm.ask("stop", acceleration=2.0)
    state = arm.ask("robot")
    assert not state["moving"]
    assert state["joints"] == [0.0]


def test_a_target_outside_the_limits_is_refused(arm):
    reply = arm.request("move", joints=[3.2], speed=1.0, acceleration=1.0)
    assert reply["error"] == "limits"
    assert "Joint 1" in reply["message"]
    assert not arm.ask("robot")["moving"]


def test_a_second_move_is_refused_while_the_first_runs(arm):
    arm.ask("move", joints=[3.0], speed=0.1, acceleration=1.0)
    assert arm.request("move", joints=[0], speed=1.0, acceleration=1.0)["error"] == "moving"


@pytest.mark.parametrize("safety", ["protective_stop", "emergency_stop", "fault", "not_ready"])
def test_a_safety_stop_brakes_the_robot_and_forbids_motion(arm, safety):
    arm.set("time_scale", SLOW)
    arm.ask("move", joints=[3.0], speed=1.0, acceleration=10.0)
    while (before := arm.ask("robot"))["joints"][0] < 0.2:
        pass
    arm.set("safety", safety)
    after = arm.ask("robot")
    while (state := arm.ask("robot"))["moving"]:
        pass
    assert state["safety"] == safety
    # 1 rad/s brakes within 1 / (2 x 10) rad, begun between the two looks.
    low, high = before["joints"][0], before["joints"][0] + after["time_s"] - before["time_s"]
    assert low + 0.05 - 1e-9 <= state["joints"][0] <= high + 0.05 + 1e-9
    assert arm.request("move", joints=[0], speed=1.0, acceleration=1.0)["error"] == "unsafe"
    arm.set("safety", "reduced")
    arm.ask("move", joints=[0], speed=1.0, acceleration=1.0)


@pytest.mark.parametrize("guarded", [True, False])
def test_a_guarded_motion_ends_when_its_client_goes_away(arm, guarded):
    with (
        socket.create_connection(("127.0.0.1", arm.port), 5) as client,
        client.makefile("rb") as lines,
    ):
        client.sendall(
            b'{"op": "move", "joints": [3.0], "speed": 0.5, "acceleration": 10, '
            b'"stop_on_disconnect": %s}\n' % str(guarded).lower().encode()
        )
        assert b'"ok": true' in lines.readline()
    while arm.ask("robot")["moving"]:
        pass
    arrived = arm.ask("robot")["joints"][0] == 3.0
    assert arrived is not guarded


def test_the_clock_runs_at_its_scale_and_does_not_jump(arm):
    began = time.monotonic()
    before = arm.ask("hello")["time_s"]
    arm.set("time_scale", 1000.0)
    after = arm.ask("hello")
    assert after["time_scale"] == 1000.0
    assert before < after["time_s"] < before + 1000.0 * (time.monotonic() - began)
    while arm.ask("hello")["time_s"] < before + 20.0:
        pass  # 20 s of the world within 20 ms of ours, else the suite's own time limit ends it.


def test_an_arm_without_length_moves_like_any_other(tmp_path):
    dot = tmp_path / "dot.yaml"
    dot.write_text(PENDULUM.replace("a_mm: 1000", "a_mm: 0").replace("[-400, 0, 0]", "[0, 0, 0]"))
    with world(tmp_path, dot, geometry_error={"length_mm": 0, "angle_mrad": 0}) as cell:
        cell.move_and_wait([0.5])
        assert cell.ask("robot")["joints"] == [0.5]


def test_a_robot_told_at_rest_has_arrived(arm):
    """Joints and motion are of one moment: a pause of the program between them cannot be seen."""
    arm.set("time_scale", 1e6)
    for number in range(SAMPLES):
        # Long enough that motions end between two looks, or between two halves of one.
        target = [1.0 + number % 2]
        arm.ask("move", joints=target, speed=0.003, acceleration=1.0)
        while (state := arm.ask("robot"))["moving"]:
            pass
        assert state["joints"] == target

"""The Modbus robot driver moves an emulated arm, and everything that has to stop it."""

import itertools
import signal
import subprocess
import sys
import time

import pytest
from modbus_cell import (
    PROFILES,
    STOP_WITHIN_S,
    go_on,
    modbus_cell,
    once_moving,
    quick,
    slow,
)
from ur_cell import ROOT, wait_until

from drivers.devices.modbus import ModbusRobot
from drivers.errors import Interrupted, NoReply, Refused, Unsafe
from drivers.interfaces import MAY_MOVE, JointMotion, Safety
from drivers.registry import open_robot

DRIVE_FAR = """
import sys
from drivers.devices.modbus import ModbusRobot
from drivers.devices.modbus.contract import Contract
from drivers.interfaces import JointMotion
robot = ModbusRobot(sys.argv[1], 6)
robot.connect()
here = robot.state().joints
robot.move(JointMotion((3.0, *here[1:]), 0.1, 1.0, 60.0), lambda: True)
"""


@pytest.fixture(scope="module")
def started_cell(tmp_path_factory):
    with modbus_cell(tmp_path_factory.mktemp("cell")) as started:
        yield started


@pytest.fixture
def cell(started_cell):
    started_cell.restore()
    return started_cell


@pytest.fixture
def robot(cell):
    driver = ModbusRobot(cell.address, 6, reply_timeout_s=0.3)
    driver.connect()
    yield driver
    driver.close()


@pytest.mark.parametrize(
    ("name", "layout"),
    [("ur10e", "generic"), ("ur10e", "staubli_cs9"), ("abb_irb910sc", "generic")],
)
def test_a_move_ends_at_the_target_with_every_layout(tmp_path, name, layout):
    with modbus_cell(tmp_path, name, layout) as cell:
        robot = open_robot("modbus", f"{cell.address}?profile={layout}", len(cell.here))
        robot.connect()
        # Half a count of the coarser layout: 1e-5 degrees.
        assert robot.state().joints == pytest.approx(cell.here, abs=0.9e-7)
        target = tuple(q - 0.1 / (1 + number) for number, q in enumerate(cell.here))
        robot.move(JointMotion(target, 1.0, 2.0, 5.0), go_on)
        assert cell.world.at_rest()
        assert cell.world.joints() == pytest.approx(target, abs=0.9e-7)
        assert robot.state().joints == pytest.approx(target, abs=1.8e-7)
        robot.close()


def test_a_sliding_joint_may_have_a_scale_of_its_own(tmp_path):
    profile = tmp_path / "scara.yaml"
    profile.write_text(
        (PROFILES / "staubli_cs9.yaml").read_text().replace("prismatic: []", "prismatic: [3]")
    )
    with modbus_cell(tmp_path, "abb_irb910sc", "staubli_cs9") as cell:
        robot = ModbusRobot(f"{cell.address}?profile={profile}", 4)
        robot.connect()
        target = (0.2, 0.1, 0.123456, 0.4)
        robot.move(JointMotion(target, 1.0, 2.0, 5.0), go_on)
        # Steps of 1e-5 degrees and 1e-4 mm.
        assert cell.world.joints() == pytest.approx(target, abs=0.9e-7)
        robot.close()


def test_the_clock_moves_and_belongs_to_the_controller(cell, robot):
    first = robot.state()
    assert (first.moving, first.safety, first.advice) == (False, Safety.normal, "")
    wait_until(lambda: robot.state().time_s > first.time_s)
    assert robot.state().time_s <= cell.world.ask("robot")["time_s"]


def test_a_move_to_where_it_is_arrives(cell, robot):
    for _ in range(2):
        robot.move(JointMotion(cell.here, 1.0, 1.0, 5.0), go_on)


def test_an_abort_stops_the_arm_within_a_third_of_a_second(cell, robot):
    abort = once_moving(cell, lambda: False)
    with pytest.raises(Interrupted):
        robot.move(slow(cell), abort)
    assert time.monotonic() - abort.done[0] < STOP_WITHIN_S
    assert cell.world.at_rest()
    robot.move(quick(cell), go_on)


def test_a_motion_that_nobody_wants_is_never_started(cell, robot):
    with pytest.raises(Interrupted):
        robot.move(quick(cell), lambda: False)
    assert cell.world.joints() == pytest.approx(cell.here, abs=1e-12)


def test_permission_is_asked_at_least_every_50_ms(cell, robot):
    asked = []

    def remember():
        asked.append(time.monotonic())
        return True

    robot.move(JointMotion((1.5, *cell.here[1:]), 0.5, 1.0, 10.0), remember)
    gaps = sorted(b - a for a, b in itertools.pairwise(asked))
    assert len(gaps) > 5
    # Nine of ten: a busy test machine may stretch single ones.
    assert gaps[len(gaps) * 9 // 10] < 0.05


def test_a_motion_past_its_deadline_is_stopped(cell, robot):
    late = JointMotion((3.0, *cell.here[1:]), speed=0.1, acceleration=1.0, deadline_s=0.3)
    with pytest.raises(NoReply, match=r"not there within 0\.3 s"):
        robot.move(late, go_on)
    assert cell.world.at_rest()


def test_a_target_outside_the_limits_is_refused_and_the_next_motion_works(cell, robot):
    with pytest.raises(Refused, match="error 2: the target is outside"):
        robot.move(JointMotion((100.0, *cell.here[1:]), 1.0, 1.0, 5.0), go_on)
    robot.move(quick(cell), go_on)


@pytest.mark.parametrize(
    ("joints", "problem"), [((300.0,) + (0.0,) * 5, "does not fit"), ((0.0,) * 5, "needs 6")]
)
def test_a_motion_that_is_not_this_robots_is_refused(cell, robot, joints, problem):
    with pytest.raises(Refused, match=problem):
        robot.move(JointMotion(joints, 1.0, 1.0, 5.0), go_on)
    assert cell.world.joints() == pytest.approx(cell.here, abs=1e-12)


def test_every_stop_of_the_safety_system_has_its_name_and_advice(cell, robot):
    for state in set(Safety) - MAY_MOVE:
        cell.world.set_safety(state.value)
        wait_until(lambda expected=state: robot.state().safety is expected)
        assert robot.state().advice
        with pytest.raises(Unsafe, match=state.value):
            robot.move(quick(cell), go_on)
        with pytest.raises(Unsafe, match=state.value):
            ModbusRobot(cell.address, 6).connect()
    assert cell.world.joints() == pytest.approx(cell.here, abs=1e-12)


def test_a_protective_stop_during_a_motion_is_reported(cell, robot):
    with pytest.raises(Unsafe, match=r"protective_stop.*clear the way"):
        robot.move(slow(cell), once_moving(cell, lambda: cell.world.set_safety("protective_stop")))
    wait_until(cell.world.at_rest, within_s=STOP_WITHIN_S)
    cell.world.set_safety("normal")
    robot.move(quick(cell), go_on)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP], ids=["killed", "frozen"])
def test_a_program_that_dies_or_freezes_stops_the_arm(cell, number):
    program = subprocess.Popen([sys.executable, "-c", DRIVE_FAR, cell.address], cwd=ROOT)
    wait_until(lambda: cell.world.joints()[0] > 0.05)
    program.send_signal(number)
    assert wait_until(cell.world.at_rest) < STOP_WITHIN_S
    assert cell.world.joints()[0] < 2.5
    program.kill()
    program.wait()


def test_a_caller_that_blocks_stops_the_arm_and_is_told(cell, robot):
    def block():
        wait_until(cell.world.at_rest, within_s=STOP_WITHIN_S)

    with pytest.raises(Refused, match="error 4: the heartbeat was missing"):
        robot.move(slow(cell), once_moving(cell, block))


def test_an_error_in_the_caller_stops_the_arm(cell, robot):
    def fail():
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        robot.move(slow(cell), once_moving(cell, fail))
    assert cell.world.at_rest()
    robot.move(quick(cell), go_on)


def test_a_robot_that_another_program_moves_is_refused(cell, robot):
    seen = []

    def connect_a_second():
        with pytest.raises(Refused, match="another program") as caught:
            ModbusRobot(cell.address, 6).connect()
        seen.append(caught.value)

    abort = once_moving(cell, lambda: connect_a_second() or False)
    with pytest.raises(Interrupted):
        robot.move(slow(cell), abort)
    assert seen


def test_a_stop_by_another_program_ends_the_motion(cell, robot):
    second = ModbusRobot(cell.address, 6)
    second.connect()
    with pytest.raises(Refused, match="another program gave command"):
        robot.move(slow(cell), once_moving(cell, second.stop))
    assert cell.world.at_rest()
    second.close()

"""The UR driver moves an emulated arm, through the real client library and the real protocol."""

import itertools
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing

import pytest
from ur_cell import HERE, Cell, emulated_cell, wait_until

from drivers.devices.ur_rtde import UrRtde
from drivers.errors import Interrupted, NoReply, Refused, Unreachable, Unsafe
from drivers.interfaces import MAY_MOVE, JointMotion, Safety

NEAR = (0.1, -1.57, 1.57, -1.57, -1.57, 0.0)
FAR = (3.0, *HERE[1:])
QUICK = JointMotion(NEAR, speed=1.05, acceleration=1.4, deadline_s=10.0)
SLOW = JointMotion(FAR, speed=0.1, acceleration=1.0, deadline_s=20.0)


@pytest.fixture(scope="module")
def started_cell(tmp_path_factory):
    with emulated_cell(tmp_path_factory.mktemp("cell"), number=5) as started:
        yield started


@pytest.fixture
def cell(started_cell):
    started_cell.restore()
    return started_cell


@pytest.fixture
def robot(cell):
    driver = UrRtde(cell.address)
    driver.connect()
    yield driver
    driver.close()


def go_on() -> bool:
    return True


class UntilMoving:
    """May continue until the world's robot moves, then does something once."""

    def __init__(self, cell: Cell, action) -> None:
        self.cell = cell
        self.action = action
        self.acted_s = None

    def __call__(self) -> bool:
        if self.acted_s is None and self.cell.world.joints()[0] > 0.05:
            self.acted_s = time.monotonic()
            return self.action()
        return self.acted_s is None or self.action is not refuse


def refuse() -> bool:
    return False


def test_a_move_ends_at_the_target(cell, robot):
    robot.move(QUICK, go_on)
    assert cell.world.at_rest()
    assert cell.world.joints() == pytest.approx(NEAR, abs=1e-12)


def test_the_state_is_that_of_the_controller_and_its_clock_moves(cell, robot):
    first = robot.state()
    assert first.joints == pytest.approx(HERE, abs=1e-12)
    assert (first.moving, first.safety, first.advice) == (False, Safety.normal, "")
    wait_until(lambda: robot.state().time_s > first.time_s)
    assert robot.state().time_s <= cell.world.ask("robot")["time_s"]


def test_a_robot_that_moves_says_so(cell, robot):
    seen = []

    def look():
        seen.append(cell.world.moving())
        return True

    robot.move(QUICK, look)
    assert any(seen)
    assert not robot.state().moving


def test_a_move_to_where_it_is_arrives(robot):
    robot.move(JointMotion(HERE, 1.0, 1.0, 5.0), go_on)
    robot.move(JointMotion(HERE, 1.0, 1.0, 5.0), go_on)


def test_an_abort_stops_the_arm_within_a_third_of_a_second(cell, robot):
    abort = UntilMoving(cell, refuse)
    with pytest.raises(Interrupted):
        robot.move(SLOW, abort)
    assert time.monotonic() - abort.acted_s < 0.3
    assert cell.world.at_rest()
    assert 0.05 < cell.world.joints()[0] < 1.0


def test_a_motion_that_nobody_wants_is_never_started(cell, robot):
    with pytest.raises(Interrupted):
        robot.move(QUICK, refuse)
    assert cell.world.joints() == pytest.approx(HERE, abs=1e-12)


def test_permission_is_asked_at_least_every_50_ms(robot):
    asked = []

    def remember():
        asked.append(time.monotonic())
        return True

    robot.move(JointMotion((1.5, *HERE[1:]), 0.5, 1.0, 10.0), remember)
    gaps = sorted(b - a for a, b in itertools.pairwise(asked))
    assert len(gaps) > 5
    # Nine of ten: a busy test machine may stretch single ones.
    assert gaps[len(gaps) * 9 // 10] < 0.05


def test_a_protective_stop_is_reported_with_advice_and_can_be_left(cell, robot):
    def trip():
        cell.world.set_safety("protective_stop")
        return True

    with pytest.raises(Unsafe, match=r"protective_stop.*unlock the protective stop"):
        robot.move(SLOW, UntilMoving(cell, trip))
    wait_until(cell.world.at_rest, within_s=0.3)
    assert robot.state().safety is Safety.protective_stop
    with pytest.raises(Unsafe):
        robot.move(QUICK, go_on)
    assert cell.dashboard("unlock protective stop") == "Protective stop releasing"
    wait_until(lambda: robot.state().safety is Safety.normal)
    robot.move(QUICK, go_on)
    assert cell.world.joints() == pytest.approx(NEAR, abs=1e-12)


def test_every_stop_of_the_safety_system_has_its_name_and_advice(cell, robot):
    for state in set(Safety) - MAY_MOVE:
        cell.world.set_safety(state.value)
        wait_until(lambda expected=state: robot.state().safety is expected)
        assert robot.state().advice
        with pytest.raises(Unsafe, match=state.value):
            robot.move(QUICK, go_on)
    assert cell.world.joints() == pytest.approx(HERE, abs=1e-12)


def test_a_robot_in_reduced_mode_may_move(cell, robot):
    cell.world.set_safety("reduced")
    wait_until(lambda: robot.state().safety is Safety.reduced)
    robot.move(QUICK, go_on)


def test_a_stop_slower_than_the_watchdog_does_not_spoil_the_next_motion(tmp_path):
    with emulated_cell(tmp_path, time_scale=1.0) as cell:
        robot = UrRtde(cell.address)
        robot.connect()
        fast = JointMotion(FAR, speed=1.6, acceleration=8.0, deadline_s=10.0)
        with pytest.raises(Interrupted):
            robot.move(fast, UntilMoving(cell, refuse))
        assert cell.world.at_rest()
        robot.move(JointMotion(tuple(cell.world.joints()), 1.0, 1.0, 5.0), go_on)
        robot.close()


def test_a_motion_past_its_deadline_is_stopped(cell, robot):
    late = JointMotion(FAR, speed=0.1, acceleration=1.0, deadline_s=0.3)
    with pytest.raises(NoReply, match=r"not there within 0\.3 s"):
        robot.move(late, go_on)
    assert cell.world.at_rest()


def test_a_target_outside_the_limits_is_refused_and_the_next_motion_works(cell, robot):
    outside = JointMotion((100.0, *HERE[1:]), 1.0, 1.0, 5.0)
    with pytest.raises(Refused):
        robot.move(outside, go_on)
    assert cell.world.joints() == pytest.approx(HERE, abs=1e-12)
    robot.move(QUICK, go_on)


def test_a_speed_that_the_client_declines_is_refused(robot):
    with pytest.raises(Refused, match="not within"):
        robot.move(JointMotion(NEAR, speed=10.0, acceleration=1.0, deadline_s=5.0), go_on)


def test_local_control_is_refused_at_connect_and_before_a_motion(cell, robot):
    cell.controller.order(fault="local_control", on=True)
    with pytest.raises(Refused, match="remote control"):
        robot.move(QUICK, go_on)
    with pytest.raises(Refused, match="remote control"):
        robot.connect()
    cell.controller.order(fault="local_control", on=False)
    robot.connect()
    robot.move(QUICK, go_on)


def test_a_stopped_robot_cannot_be_connected_and_says_what_to_do(cell):
    cell.world.set_safety("emergency_stop")
    robot = UrRtde(cell.address)
    with pytest.raises(Unsafe, match="release the emergency stop"):
        robot.connect()
    assert robot.child_pid is None
    robot.close()


def test_a_program_stopped_at_the_pendant_ends_the_motion(cell, robot):
    def press_stop():
        cell.dashboard("stop")
        return True

    with pytest.raises(Refused, match="stopped during the motion"):
        robot.move(SLOW, UntilMoving(cell, press_stop))
    assert cell.world.at_rest()
    robot.move(QUICK, go_on)


def test_a_robot_model_without_six_joints_is_refused():
    with pytest.raises(Refused, match="6 joints"):
        UrRtde("127.0.0.2", n_joints=4)


def test_use_before_connect_is_refused():
    robot = UrRtde("127.0.0.2")
    with pytest.raises(Unreachable, match="connect first"):
        robot.state()
    robot.stop()
    robot.close()


def test_two_controllers_move_two_arms_at_once(tmp_path):
    with (
        emulated_cell(tmp_path, 2) as left,
        emulated_cell(tmp_path, 3) as right,
        ThreadPoolExecutor(2) as threads,
        closing(UrRtde(left.address)) as first,
        closing(UrRtde(right.address)) as second,
    ):
        robots = [first, second]
        targets = [NEAR, (-0.5, *HERE[1:])]
        for robot in robots:
            robot.connect()
        motions = [JointMotion(target, 0.05, 1.0, 10.0) for target in targets]
        moves = [
            threads.submit(robot.move, motion, go_on)
            for robot, motion in zip(robots, motions, strict=True)
        ]
        wait_until(lambda: left.world.moving() and right.world.moving())
        for move in moves:
            move.result(10)
        for cell, target in ((left, NEAR), (right, targets[1])):
            assert cell.world.joints() == pytest.approx(target, abs=1e-12)

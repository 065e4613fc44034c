"""The Modbus robot driver moves an emulated arm; every fault of the wire, loss and stop."""

import itertools
import re
import signal
import socket
import subprocess
import sys
import time

import pytest
from instrument_cell import TRANSCRIPTS
from modbus_cell import Cell, modbus_cell
from ur_cell import ROOT, wait_until

from drivers.devices.modbus import ModbusRobot
from drivers.devices.modbus.contract import Contract
from drivers.errors import BadReply, Interrupted, NoReply, Refused, Unreachable, Unsafe
from drivers.interfaces import MAY_MOVE, JointMotion, Safety
from drivers.modbus_link import Table, over_tcp
from drivers.registry import open_robot

PROFILES = ROOT / "drivers" / "profiles"
STOP_WITHIN_S = 0.3
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


def quick(cell: Cell) -> JointMotion:
    return JointMotion((cell.here[0] + 0.1, *cell.here[1:]), 1.0, 2.0, deadline_s=5.0)


def slow(cell: Cell) -> JointMotion:
    return JointMotion((3.0, *cell.here[1:]), speed=0.1, acceleration=1.0, deadline_s=20.0)


def go_on() -> bool:
    return True


def once_moving(cell: Cell, action):
    """Permission that does something once, when the world's robot moves."""
    done = []

    def may_continue() -> bool:
        if not done and cell.world.joints()[0] > cell.here[0] + 0.02:
            done.append(time.monotonic())
            return action() is not False
        return True

    may_continue.done = done
    return may_continue


def assert_stays(cell: Cell, for_s: float = 0.4) -> None:
    stopped_at = cell.world.joints()
    end_s = time.monotonic() + for_s
    while time.monotonic() < end_s:
        assert cell.world.joints() == stopped_at
        time.sleep(0.05)


# Motion.


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
    wait_until(lambda: robot.state().time_s > first.time_s, within_s=1.0)
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


# Safety.


def test_every_stop_of_the_safety_system_has_its_name_and_advice(cell, robot):
    for state in set(Safety) - MAY_MOVE:
        cell.world.set_safety(state.value)
        wait_until(lambda expected=state: robot.state().safety is expected, within_s=1.0)
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
    wait_until(lambda: cell.world.joints()[0] > 0.05, within_s=10.0)
    program.send_signal(number)
    assert wait_until(cell.world.at_rest, within_s=2.0) < STOP_WITHIN_S
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


# Faults of the wire.

ONCE = ["silence", "late_reply", "cut_reply", "noise", "wrong_id", "wrong_transaction", "reset"]


@pytest.mark.parametrize("kind", [*ONCE, "closed"])
def test_a_fault_of_the_wire_is_overcome_by_a_reading(cell, robot, kind):
    cell.fault(kind, delay_s=0.4 if kind == "late_reply" else 0.0)
    for _ in range(2):
        assert robot.state().joints == pytest.approx(cell.here, abs=1e-7)
    robot.move(quick(cell), go_on)
    assert robot.state().joints == pytest.approx(quick(cell).joints, abs=1e-7)


@pytest.mark.parametrize(
    ("kind", "error"),
    [("silence", NoReply), ("cut_reply", BadReply), ("wrong_id", BadReply), ("reset", NoReply)],
)
def test_a_fault_that_lasts_is_told_and_forgotten_when_it_is_over(cell, robot, kind, error):
    cell.fault(kind, replies=100)
    with pytest.raises(error, match="check") as caught:
        robot.state()
    assert "modbus" in caught.value.device
    assert caught.value.command == "read status"
    assert bool(caught.value.raw) == (error is BadReply)
    cell.fault("none")
    assert robot.state().joints == pytest.approx(cell.here, abs=1e-7)


@pytest.mark.parametrize(
    "order",
    [
        *({"kind": kind} for kind in ONCE if kind != "late_reply"),
        {"kind": "late_reply", "delay_s": 0.5},
        {"kind": "closed"},
        {"kind": "code", "code": 6},
        {"kind": "half_open"},
        {"kind": "frozen"},
        {"kind": "refused"},
    ],
    ids=lambda order: order["kind"],
)
def test_a_fault_during_a_motion_stops_the_arm_and_never_starts_it_again(cell, robot, order):
    with pytest.raises((NoReply, BadReply, Refused, Unreachable)):
        robot.move(slow(cell), once_moving(cell, lambda: cell.fault(**order)))
    wait_until(cell.world.at_rest, within_s=1.0)
    assert cell.world.joints()[0] < 2.5
    assert_stays(cell)
    cell.fault("none")
    wait_until(lambda: not robot.state().moving, within_s=1.0)
    robot.move(JointMotion(cell.here, 1.0, 2.0, 10.0), go_on)
    assert cell.world.joints() == pytest.approx(cell.here, abs=1e-7)


def test_a_lost_network_stops_the_arm_within_a_third_of_a_second(cell, robot):
    rest_s = []

    def cut():
        cell.fault("half_open")
        rest_s.append(wait_until(cell.world.at_rest, within_s=2.0))

    with pytest.raises(NoReply):
        robot.move(slow(cell), once_moving(cell, cut))
    assert rest_s[0] < STOP_WITHIN_S


def test_an_exception_code_is_refused_with_its_meaning(cell, robot):
    cell.fault("code", code=6)
    with pytest.raises(Refused, match="exception 6, busy") as caught:
        robot.state()
    assert caught.value.raw


def test_a_counter_that_stands_still_is_no_reading(cell, robot):
    robot.state()
    cell.fault("frozen")
    with pytest.raises(NoReply, match="counter stands still"):
        robot.state()
    cell.fault("none")
    robot.connect()


def test_a_port_that_is_closed_is_unreachable_and_works_when_it_is_back(cell, robot):
    cell.fault("refused")
    with pytest.raises(Unreachable, match="switched on"):
        robot.state()
    cell.fault("none")
    assert robot.state().joints == pytest.approx(cell.here, abs=1e-7)


def test_a_host_that_accepts_and_stays_silent_is_told_soon(cell):
    cell.fault("half_open")
    start_s = time.monotonic()
    with pytest.raises(NoReply):
        ModbusRobot(cell.address, 6, reply_timeout_s=0.2).connect()
    assert time.monotonic() - start_s < 2.0


# The contract.


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("word_order: big", "word_order: little", "check word reads 0x03040102"),
        ("check:    {address: 0, type: uint32}", "clock: {address: 0, type: uint32}", "check word"),
        ("status_table: input", "status_table: holding", "illegal data address"),
    ],
)
def test_a_profile_that_does_not_fit_the_controller_is_refused(cell, tmp_path, old, new, problem):
    text = (PROFILES / "generic.yaml").read_text()
    assert old in text
    if "clock" in new:
        text = text.replace("clock:    {address: 4,", "check: {address: 4,")
    text = text.replace(old, new)
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    robot = ModbusRobot(f"{cell.address}?profile={path}", 6)
    with pytest.raises(Refused, match=problem):
        robot.connect()
    robot.close()


def test_a_robot_with_another_number_of_joints_is_refused(cell):
    robot = ModbusRobot(cell.address, 4)
    with pytest.raises(Refused, match="has 6 joints, the cell's model has 4"):
        robot.connect()
    robot.close()


def test_use_before_connect_is_refused():
    robot = ModbusRobot("127.0.0.1:502", 6)
    with pytest.raises(Unreachable, match="call connect"):
        robot.state()
    robot.stop()
    robot.close()


def test_the_controller_answers_byte_for_byte(tmp_path):
    lines = (TRANSCRIPTS / "modbus_robot.txt").read_text().splitlines()
    frames = [line for line in lines if line[0] in "<>"]
    with modbus_cell(tmp_path) as cell:
        cell.world.ask("move", joints=[0.0] * 6, speed=1e2, acceleration=1e3)
        wait_until(cell.world.at_rest, within_s=1.0)
        host, _, port = cell.address.partition(":")
        with socket.create_connection((host, int(port)), 5) as connection:
            for request, reply in zip(frames[::2], frames[1::2], strict=True):
                connection.sendall(bytes.fromhex(request[2:]))
                pattern = b"".join(
                    b".{%s}" % word[1:2].encode()
                    if word[0] == "{"
                    else re.escape(bytes.fromhex(word))
                    for word in reply[2:].split()
                )
                assert re.fullmatch(pattern, connection.recv(4096), re.DOTALL), request
        wait_until(lambda: cell.world.joints()[0] > 0.0, within_s=1.0)


def test_a_command_that_comes_twice_moves_the_robot_once(cell):
    """What a network may deliver again bears the same number."""
    far = JointMotion((cell.here[0] + 0.5, *cell.here[1:]), 1.0, 2.0, 5.0)
    block = Contract("robot", "generic", 6)
    link = over_tcp("robot", cell.address, 1, 1.0)
    link.open()
    sequence = block.decode(link.read("look", Table.input, 0, 24)).accepted + 1
    link.write("move", 100, block.move_block(sequence, far))
    wait_until(cell.world.moving, within_s=1.0)
    cell.world.ask("stop", acceleration=1e3)
    wait_until(cell.world.at_rest, within_s=1.0)
    link.write("move", 100, block.move_block(sequence, far))
    assert_stays(cell)
    link.close()

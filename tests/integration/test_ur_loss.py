"""Every way to lose a UR: the robot stops, the driver says why, no process is left behind."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from ur_cell import HERE, ROOT, address, emulated_cell, wait_until

from drivers.devices.ur_rtde import UrRtde
from drivers.errors import BadReply, NoReply, Refused, Unreachable
from drivers.interfaces import JointMotion

FAR = (3.0, *HERE[1:])
SLOW = JointMotion(FAR, speed=0.1, acceleration=1.0, deadline_s=20.0)
QUICK = JointMotion((0.1, *HERE[1:]), speed=1.0, acceleration=2.0, deadline_s=5.0)
STOP_WITHIN_S = 0.3
STARTS = 5

DRIVE_FAR = """
import contextlib, sys
from drivers.devices.ur_rtde import UrRtde
from drivers.errors import Refused
from drivers.interfaces import JointMotion
robot = UrRtde(sys.argv[1])
robot.connect()
print(robot.child_pid, flush=True)
while True:
    # On a starved machine the watchdog may stop the control program before the arm sets out.
    with contextlib.suppress(Refused):
        robot.move(JointMotion({target}, 0.1, 1.0, 60.0), lambda: True)
"""


@pytest.fixture
def cell(tmp_path):
    with emulated_cell(tmp_path) as started:
        yield started


@pytest.fixture
def robot(cell):
    driver = UrRtde(cell.address)
    driver.connect()
    yield driver
    driver.close()


def go_on() -> bool:
    return True


def once_moving(cell, action):
    """Permission that does something once, when the world's robot moves."""
    done = []

    def may_continue() -> bool:
        if not done and cell.world.joints()[0] > 0.02:
            done.append(time.monotonic())
            action()
        return True

    may_continue.done = done
    return may_continue


def move_and(robot, cell, action):
    """Move slowly, and do something in the middle of it."""
    permission = once_moving(cell, action)
    for _ in range(STARTS):
        # On a starved machine the watchdog may stop the control program before the arm sets out.
        with suppress(Refused):
            robot.move(SLOW, permission)
        assert not permission.done, "the motion was refused, or came to its end, all the same"
    pytest.fail(f"the arm did not set out at {STARTS} starts")


def hangs_up(order: dict) -> bool:
    return order["fault"] != "silent"


def process_exists(pid: int) -> bool:
    stat = Path(f"/proc/{pid}/stat")
    return stat.exists() and stat.read_text().rpartition(")")[2].split()[0] != "Z"


def test_closing_leaves_no_process_and_no_motion(cell, robot):
    pid = robot.child_pid
    assert process_exists(pid)
    robot.close()
    assert not process_exists(pid)
    assert cell.dashboard("running") == "Program running: false"
    robot.close()


def test_an_address_where_nobody_listens_is_unreachable():
    with pytest.raises(Unreachable, match=r"port 29999: the connection is refused"):
        UrRtde(address(9)).connect()


def test_a_host_that_accepts_and_stays_silent_is_unreachable_soon(cell):
    cell.controller.order(fault="silent", on=True)
    robot = UrRtde(cell.address)
    start_s = time.monotonic()
    with pytest.raises(Unreachable, match=r"port 29999: nothing answers within 2 s"):
        robot.connect()
    assert time.monotonic() - start_s < 3.0
    assert robot.child_pid is None


@contextmanager
def half_a_controller(where: str, greeting: bytes):
    """Greets on the dashboard, negotiates RTDE, and then never says anything again."""
    replies = {29999: greeting, 30004: bytes.fromhex("00045601"), 30003: b""}
    servers = {port: socket.create_server((where, port)) for port in replies}
    connections = []

    def serve(port: int) -> None:
        while True:
            try:
                connection, _ = servers[port].accept()
            except OSError:
                return
            connections.append(connection)
            connection.sendall(replies[port])

    threads = [threading.Thread(target=serve, args=(port,)) for port in servers]
    for thread in threads:
        thread.start()
    try:
        yield
    finally:
        for server in servers.values():
            server.shutdown(socket.SHUT_RDWR)
            server.close()
        for thread in threads:
            thread.join()
        for connection in connections:
            connection.close()


def test_a_constructor_that_hangs_is_killed(tmp_path):
    where = address(8)
    robot = UrRtde(where, connect_deadline_s=1.0)
    with half_a_controller(where, b"Connected: Universal Robots Dashboard Server\n"):
        start_s = time.monotonic()
        with pytest.raises(Unreachable, match="did not take the control program within 1 s"):
            robot.connect()
        assert time.monotonic() - start_s < 2.0
    assert robot.child_pid is None


def test_a_program_killed_at_a_hanging_constructor_leaves_no_child():
    where = address(8)
    code = (
        "import sys; from drivers.devices.ur_rtde import UrRtde\n"
        "UrRtde(sys.argv[1], connect_deadline_s=1.0).connect()"
    )
    with half_a_controller(where, b"Connected: Universal Robots Dashboard Server\n"):
        program = subprocess.Popen([sys.executable, "-c", code, where], cwd=ROOT)
        children = Path(f"/proc/{program.pid}/task/{program.pid}/children")
        wait_until(lambda: children.read_text() != "")
        child = int(children.read_text())
        program.kill()
        program.wait()
        wait_until(lambda: not process_exists(child))


def test_something_else_than_a_controller_is_a_bad_reply():
    where = address(8)
    greeting = b"220 mail.example ESMTP ready, this is no robot at all\r\n"
    with (
        half_a_controller(where, greeting),
        pytest.raises(BadReply, match="no UR controller") as caught,
    ):
        UrRtde(where).connect()
    assert greeting.startswith(caught.value.raw)


def test_a_second_driver_on_the_same_robot_is_refused(cell, robot):
    with pytest.raises(Refused, match="another program controls this robot"):
        UrRtde(cell.address).connect()
    robot.move(QUICK, go_on)


@pytest.mark.parametrize(
    "order",
    [{"fault": "silent", "on": True}, {"fault": "dropped"}, {"fault": "refused", "on": True}],
    ids=lambda order: order["fault"],
)
def test_a_connection_lost_in_motion_stops_the_arm_for_good(cell, robot, order):
    rest_s = []

    def lose():
        cell.controller.order(**order)
        lost_s = time.monotonic()
        if hangs_up(order):
            # Before the client library has reconnected and could send the motion again.
            wait_until(lambda: not process_exists(pid), within_s=STOP_WITHIN_S)
        wait_until(cell.world.at_rest)
        rest_s.append(time.monotonic() - lost_s)

    pid = robot.child_pid
    with pytest.raises(NoReply):
        move_and(robot, cell, lose)
    assert rest_s[0] < STOP_WITHIN_S
    wait_until(lambda: not process_exists(pid))
    stopped_at = cell.world.joints()
    end_s = time.monotonic() + 0.5
    while time.monotonic() < end_s:
        assert cell.world.joints() == stopped_at
        time.sleep(0.05)


@pytest.mark.parametrize("fault", ["silent", "refused"])
def test_after_a_loss_a_new_connection_works(cell, robot, fault):
    cell.controller.order(fault=fault, on=True)
    with pytest.raises(NoReply):
        wait_until(lambda: robot.state().time_s < 0.0)
    with pytest.raises(Unreachable):
        robot.connect()
    cell.controller.order(fault=fault, on=False)
    robot.connect()
    robot.move(QUICK, go_on)
    assert cell.world.joints() == pytest.approx(QUICK.joints, abs=1e-12)


def test_values_that_do_not_move_any_more_are_no_reading(cell, robot):
    cell.controller.order(fault="frozen", on=True)
    with pytest.raises(NoReply, match="clock stands still"):
        wait_until(lambda: robot.state().time_s < 0.0)


def test_a_killed_child_stops_the_arm(cell, robot):
    rest_s = []

    def kill():
        os.kill(robot.child_pid, signal.SIGKILL)
        rest_s.append(wait_until(cell.world.at_rest))

    with pytest.raises(NoReply, match="ended with status -9"):
        move_and(robot, cell, kill)
    assert rest_s[0] < STOP_WITHIN_S
    robot.connect()
    robot.move(QUICK, go_on)


def test_a_caller_that_blocks_stops_the_arm_and_is_told(cell, robot):
    def block():
        wait_until(cell.world.at_rest, within_s=STOP_WITHIN_S)

    with pytest.raises(NoReply, match="did not look after the motion"):
        move_and(robot, cell, block)


def test_an_error_in_the_caller_stops_the_arm(cell, robot):
    def fail():
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        move_and(robot, cell, fail)
    assert cell.world.at_rest()
    robot.move(QUICK, go_on)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP], ids=["killed", "frozen"])
def test_a_program_that_dies_or_freezes_stops_the_arm(cell, number):
    code = DRIVE_FAR.format(target=FAR)
    program = subprocess.Popen(
        [sys.executable, "-c", code, cell.address], stdout=subprocess.PIPE, cwd=ROOT
    )
    child = int(program.stdout.readline())
    wait_until(lambda: cell.world.joints()[0] > 0.05)
    program.send_signal(number)
    assert wait_until(cell.world.at_rest) < STOP_WITHIN_S
    assert cell.world.joints()[0] < 2.5
    program.kill()
    program.wait()
    program.stdout.close()
    wait_until(lambda: not process_exists(child))

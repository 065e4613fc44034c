"""Every fault of a Modbus robot's wire, at rest and in motion, and contracts that do not fit."""

import re
import socket
import time

import pytest
from instrument_cell import TRANSCRIPTS
from modbus_cell import (
    PROFILES,
    STOP_WITHIN_S,
    assert_stays,
    go_on,
    modbus_cell,
    once_moving,
    quick,
    slow,
)
from ur_cell import wait_until

from drivers.devices.modbus import ModbusRobot
from drivers.devices.modbus.contract import Contract
from drivers.errors import BadReply, NoReply, Refused, Unreachable
from drivers.interfaces import JointMotion
from drivers.modbus_link import Table, over_tcp


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
    wait_until(cell.world.at_rest)
    assert cell.world.joints()[0] < 2.5
    assert_stays(cell)
    cell.fault("none")
    wait_until(lambda: not robot.state().moving)
    robot.move(JointMotion(cell.here, 1.0, 2.0, 10.0), go_on)
    assert cell.world.joints() == pytest.approx(cell.here, abs=1e-7)


def test_a_lost_network_stops_the_arm_within_a_third_of_a_second(cell, robot):
    rest_s = []

    def cut():
        cell.fault("half_open")
        rest_s.append(wait_until(cell.world.at_rest))

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
        wait_until(cell.world.at_rest)
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
        wait_until(lambda: cell.world.joints()[0] > 0.0)


def test_a_command_that_comes_twice_moves_the_robot_once(cell):
    """What a network may deliver again bears the same number."""
    far = JointMotion((cell.here[0] + 0.5, *cell.here[1:]), 1.0, 2.0, 5.0)
    block = Contract("robot", "generic", 6)
    link = over_tcp("robot", cell.address, 1, 1.0)
    link.open()
    sequence = block.decode(link.read("look", Table.input, 0, 24)).accepted + 1
    link.write("move", 100, block.move_block(sequence, far))
    wait_until(cell.world.moving)
    cell.world.ask("stop", acceleration=1e3)
    wait_until(cell.world.at_rest)
    link.write("move", 100, block.move_block(sequence, far))
    assert_stays(cell)
    link.close()

"""The Modbus robot driver on its own: bytes of a fixed conversation, and wrong profiles."""

import socket
import threading
from contextlib import contextmanager
from pathlib import Path

import pytest

from drivers.devices.modbus import ModbusRobot
from drivers.errors import Refused, Unreachable
from drivers.interfaces import JointMotion

TRANSCRIPT = Path(__file__).parent / "transcripts" / "modbus_robot.txt"
GENERIC = Path(__file__).parents[2] / "drivers" / "profiles" / "generic.yaml"
LINES = [line for line in TRANSCRIPT.read_text().splitlines() if line[0] in "<>"]
LOOK, SEEN, MOVE, MOVED, BEAT, BEATEN = (line[2:] for line in LINES)


def status(counter: int, *, accepted: int = 0, done: int = 0, busy: int = 0) -> str:
    """The transcript's status reply with other registers, joint 1 at the target when done."""
    reply = SEEN.replace("{2}", f"{counter:04x}").replace("{4}", "00000bb8")
    rest = "00 00 00 00 00 00 00 00 00 01"
    assert rest in reply
    words = f"{accepted:04x} {done:04x} {busy:04x} 0000 0001"
    head, _, tail = reply.partition(rest)
    if done:
        tail = tail.replace("00 00 00 00 00 00", "00 00 00 0f 42 40", 1)
    return head + words + tail


@contextmanager
def scripted_controller(conversation: list[tuple[str, str]]):
    """Answer each request that comes, in this order and byte for byte but for the transaction."""
    listener = socket.create_server(("127.0.0.1", 0))
    surprises: list[tuple[bytes, bytes]] = []
    left = [(bytes.fromhex(request), bytes.fromhex(reply)) for request, reply in conversation]

    def serve() -> None:
        connection, _ = listener.accept()
        with connection:
            while received := connection.recv(4096):
                expected, reply = left.pop(0) if left else (b"", b"")
                if received[2:] != expected[2:]:
                    surprises.append((received, expected))
                connection.sendall(received[:2] + reply[2:])

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield f"127.0.0.1:{listener.getsockname()[1]}"
    finally:
        thread.join()
        listener.close()
    assert surprises == []
    assert left == []


def test_a_motion_is_held_byte_for_byte():
    conversation = [
        (LOOK, status(1)),  # connect: twice, since the counter must move
        (LOOK, status(2)),
        (LOOK, status(3)),  # move: a fresh look, the command, its acceptance
        (MOVE, MOVED),
        (LOOK, status(4, accepted=1, busy=1)),
        (BEAT, BEATEN),
        (LOOK, status(5, accepted=1, done=1)),
        (LOOK, status(6, accepted=1, done=1)),  # close: does it move?
    ]
    with scripted_controller(conversation) as address:
        robot = ModbusRobot(address, 6)
        robot.connect()
        robot.move(JointMotion((0.1, 0, 0, 0, 0, 0), 1.0, 2.0, 5.0), lambda: True)
        robot.close()


def profile(tmp_path: Path, *changes: tuple[str, str]) -> Path:
    text = GENERIC.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    return path


def test_built_in_registers_of_1_mrad_are_refused_with_the_reason(tmp_path):
    # Universal Robots' own server: joints as int16 in mrad from register 270 on.
    built_in = profile(
        tmp_path,
        ("joints:   {address: 12, type: int32}", "joints: {address: 270, type: int16}"),
        ("joint_scale: 1.0e-7", "joint_scale: 1.0e-3"),
    )
    with pytest.raises(Refused, match=r"1 mrad a count, which is 1 mm at 1 m.*32 bits"):
        ModbusRobot(f"127.0.0.1:502?profile={built_in}", 6)


def test_coarse_steps_in_32_bits_are_refused_too(tmp_path):
    coarse = profile(tmp_path, ("joint_scale: 1.0e-7", "joint_scale: 1.0e-3"))
    with pytest.raises(Refused, match="steps of 1000 micrometre at 1 m"):
        ModbusRobot(f"127.0.0.1:502?profile={coarse}", 6)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        (
            "{address: 3, type: uint16}",
            "{address: 6, type: uint16}",
            "lies over field counter at 6",
        ),
        ("{address: 12, type: int32}", "{address: 200, type: int32}", "one request carries 125"),
        ("{address: 12, type: int32}", "{address: 12, type: int24}", "not one of"),
        ("word_order: big", "word_order: mixed", "not one of big, little"),
        ("1: normal, ", "1: fine, ", "'fine', which is no safety state"),
        ("kind: robot", "kind: temperature", "not one of robot"),
        ("watchdog_s: 0.2", "watchdog_s: 2.0", "is not within 0 to 0.25 s"),
        ("watchdog_s: 0.2", "watchdog: 0.2", "field watchdog_s is missing"),
    ],
)
def test_a_wrong_profile_is_refused_by_file_and_field(tmp_path, old, new, problem):
    wrong = profile(tmp_path, (old, new))
    with pytest.raises(Refused, match=problem) as caught:
        ModbusRobot(f"127.0.0.1:502?profile={wrong}", 6)
    assert "mine.yaml" in caught.value.reason


def test_a_profile_that_is_not_there_is_answered_with_those_that_are():
    with pytest.raises(Refused, match=r"generic.*staubli_cs9"):
        ModbusRobot("127.0.0.1:502?profile=kuka", 6)


def test_an_address_of_another_form_is_unreachable():
    with pytest.raises(Unreachable, match="host:port"):
        ModbusRobot("127.0.0.1", 6)

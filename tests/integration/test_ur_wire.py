"""Emulator and driver against the bytes of the protocol."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from ur_cell import address, emulated_cell

from drivers.devices.ur_rtde import UrRtde
from drivers.errors import Interrupted
from drivers.interfaces import JointMotion

TRANSCRIPTS = Path(__file__).parents[1] / "drivers" / "transcripts"
PORTS = (29999, 30003, 30004)


def read_transcript(name: str) -> Iterator[tuple[str, str]]:
    for line in (TRANSCRIPTS / name).read_text().splitlines():
        if not line.startswith("#"):
            yield line[0], line[2:]


def receive(wire: socket.socket, count: int) -> bytes:
    received = b""
    while len(received) < count:
        chunk = wire.recv(count - len(received))
        assert chunk, f"the emulator hung up after {received!r}"
        received += chunk
    return received


@pytest.fixture(scope="module")
def started_cell(tmp_path_factory):
    with emulated_cell(tmp_path_factory.mktemp("cell"), number=6) as started:
        yield started


@pytest.fixture
def cell(started_cell):
    started_cell.restore()
    return started_cell


def test_the_emulator_speaks_the_handshake_of_the_transcript(cell):
    with socket.create_connection((cell.address, 30004), 5) as wire:
        for direction, text in read_transcript("ur_rtde_handshake.txt"):
            expected = bytes.fromhex(text)
            if direction == ">":
                wire.sendall(expected)
            else:
                assert receive(wire, len(expected)) == expected


def test_the_emulator_streams_what_was_asked_for(cell):
    with socket.create_connection((cell.address, 30004), 5) as wire:
        for text in [t for d, t in read_transcript("ur_rtde_handshake.txt") if d == ">"][2:]:
            wire.sendall(bytes.fromhex(text))
        receive(wire, 19 + 9 + 4)
        package = receive(wire, 60)
    # Size 60, type U, recipe 1, then 7 doubles; the second joint stands at -pi/2.
    assert package[:4] == bytes.fromhex("003c5501")
    assert package[20:28] == bytes.fromhex("bff921fb54442d18")


def test_an_unknown_field_is_not_found_and_a_taken_register_is_in_use(cell):
    ask_bogus = b"\x00\x10O" + bytes.fromhex("4000000000000000") + b"bogus"
    ask_register = bytes.fromhex("001849") + b"input_int_register_0,"
    with (
        socket.create_connection((cell.address, 30004), 5) as first,
        socket.create_connection((cell.address, 30004), 5) as second,
    ):
        first.sendall(ask_bogus)
        assert receive(first, 13) == b"\x00\x0dO\x00NOT_FOUND"
        first.sendall(ask_register)
        assert receive(first, 9)[3:] == b"\x01INT32"
        second.sendall(ask_register)
        assert receive(second, 10)[3:] == b"\x00IN_USE"


def test_the_dashboard_answers_as_in_the_transcript(cell):
    with socket.create_connection((cell.address, 29999), 5) as wire:
        lines = wire.makefile("rw", newline="\n")
        for direction, text in read_transcript("ur_dashboard.txt"):
            if direction == ">":
                lines.write(text + "\n")
                lines.flush()
            else:
                assert lines.readline() == text + "\n"
        lines.close()


def test_the_dashboard_switches_the_arm_off_and_on(cell):
    cell.dashboard("power off")
    assert cell.dashboard("robotmode") == "Robotmode: POWER_OFF"
    assert cell.world.ask("robot")["safety"] == "not_ready"
    cell.dashboard("power on")
    assert cell.dashboard("robotmode") == "Robotmode: IDLE"
    cell.dashboard("brake release")
    assert cell.dashboard("robotmode") == "Robotmode: RUNNING"
    assert cell.world.ask("robot")["safety"] == "normal"


class Relay:
    """Passes connections on to a controller, and keeps what clients send."""

    def __init__(self, where: str, to: str) -> None:
        self.heard: list[tuple[int, bytearray]] = []
        self._to = to
        self._ends: list[socket.socket] = []
        self._servers = [socket.create_server((where, port)) for port in PORTS]
        self._threads: list[threading.Thread] = []
        for server, port in zip(self._servers, PORTS, strict=True):
            self._run(self._accept, server, port)

    def close(self) -> None:
        for end in (*self._servers, *self._ends):
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
        for thread in self._threads:
            thread.join()
        for end in (*self._servers, *self._ends):
            end.close()

    def _run(self, target, *arguments) -> None:
        thread = threading.Thread(target=target, args=arguments)
        self._threads.append(thread)
        thread.start()

    def _accept(self, server: socket.socket, port: int) -> None:
        with suppress(OSError):
            while True:
                client, _ = server.accept()
                controller = socket.create_connection((self._to, port))
                self._ends += client, controller
                self.heard.append((port, bytearray()))
                self._run(self._pump, client, controller, self.heard[-1][1])
                self._run(self._pump, controller, client, bytearray())

    def _pump(self, source: socket.socket, sink: socket.socket, heard: bytearray) -> None:
        with suppress(OSError):
            while chunk := source.recv(65536):
                heard += chunk
                sink.sendall(chunk)
            sink.shutdown(socket.SHUT_WR)


@contextmanager
def relay(where: str, to: str) -> Iterator[Relay]:
    opened = Relay(where, to)
    try:
        yield opened
    finally:
        opened.close()


def frames(stream: bytes) -> list[bytes]:
    found = []
    while stream:
        size = int.from_bytes(stream[:2], "big")
        found.append(stream[:size])
        stream = stream[size:]
    return found


def test_the_driver_sends_the_bytes_of_the_transcript(cell):
    target = (0.1, -1.57, 1.57, -1.57, -1.57, 0.0)
    where = address(7)
    cell.world.ask("set", name="time_scale", value=1.0)
    with relay(where, cell.address) as relayed:
        robot = UrRtde(where)
        robot.connect()
        with pytest.raises(Interrupted):
            robot.move(JointMotion(target, 1.05, 1.4, 10.0), Twice())
        robot.close()
    control = bytes(max((sent for port, sent in relayed.heard if port == 30004), key=len))
    wanted = [bytes.fromhex(text) for _, text in read_transcript("ur_rtde_commands.txt")]
    sent = iter(frames(control))
    for expected in wanted:
        assert expected in sent, f"{expected.hex(' ')} was not sent in its turn"
    assert sum(frame[3:8] == wanted[2][3:8] for frame in frames(control)) == 1


class Twice:
    """Permission for the start and a few looks, so that a kick and then a stop are sent."""

    def __init__(self) -> None:
        self.left = 5

    def __call__(self) -> bool:
        self.left -= 1
        return self.left > 0

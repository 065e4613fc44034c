"""Parts of the UR driver and its emulator that need no connection."""

import io
import os
import pickle
from types import SimpleNamespace

import pytest

from drivers.devices.ur_rtde import arm
from drivers.devices.ur_rtde.messages import Done, Inbox, Outbox, StartMotion
from drivers.devices.ur_rtde.safety import ADVICE, advice, safety_state
from drivers.errors import Unsafe
from drivers.interfaces import MAY_MOVE, Safety

POWERED, RUNNING = 1, 7

# Bits of safety_status_bits as the RTDE Guide numbers them; 0x404 is what a protective stop of
# an emulated PolyScope 5.11 was recorded with.
STATES = [
    (0x001, Safety.normal),
    (0x002, Safety.reduced),
    (0x404, Safety.protective_stop),
    (0x008, Safety.not_ready),
    (0x410, Safety.safeguard_stop),
    (0x420, Safety.emergency_stop),
    (0x4C0, Safety.emergency_stop),
    (0x500, Safety.fault),
    (0x600, Safety.fault),
    (0x484, Safety.emergency_stop),
    (0x000, Safety.not_ready),
]


@pytest.mark.parametrize(("bits", "state"), STATES)
def test_status_bits_mean_the_state_of_the_guide(bits, state):
    assert safety_state(bits, POWERED, RUNNING) is state


def test_an_arm_without_power_or_with_closed_brakes_is_not_ready():
    assert safety_state(0x001, 0, 3) is Safety.not_ready
    assert safety_state(0x001, POWERED, 5) is Safety.not_ready


def test_a_stop_is_named_even_when_it_took_the_power():
    assert safety_state(0x4C0, 0, 3) is Safety.emergency_stop


def test_every_state_without_motion_has_advice_and_no_other():
    assert set(ADVICE) == set(Safety) - MAY_MOVE
    assert advice(Safety.normal) == ""


def test_messages_cross_a_pipe_whole_and_its_end_is_noticed():
    reading, writing = os.pipe()
    inbox = Inbox(os.fdopen(reading, "rb"))
    stream = os.fdopen(writing, "wb")
    outbox = Outbox(stream)
    motion = StartMotion((0.1, -0.2), 1.0, 2.0)
    outbox.send(motion)
    outbox.send(Unsafe("robot", "moveJ", "stopped: unlock it"))
    assert inbox.take(1.0) == motion
    error = inbox.take(1.0)
    assert isinstance(error, Unsafe)
    assert error.reason == "stopped: unlock it"
    assert inbox.take(0.0) is None
    stream.close()
    with pytest.raises(EOFError):
        inbox.take(1.0)
    inbox.join()


def test_half_a_message_of_a_killed_writer_is_an_end():
    inbox = Inbox(io.BytesIO(pickle.dumps(Done()) + pickle.dumps(Done())[:-3]))
    assert inbox.take(1.0) == Done()
    with pytest.raises(EOFError):
        inbox.take(1.0)
    inbox.join()


class Controller:
    """Stands behind the three clients; why a program ended is told two packages later."""

    NORMAL, PROTECTIVE_STOP = 0x001, 0x404
    READS_A_PACKAGE = 5

    def __init__(self):
        self.reads = 0
        self.running = True
        self.stopped_at = None

    def clients(self):
        return SimpleNamespace(
            connect=lambda: True,
            polyscopeVersion=lambda: "3.15.4",
            setWatchdog=lambda _: True,
            isProgramRunning=lambda: self.running,
            getTimestamp=self.timestamp,
            getSafetyStatusBits=self.safety_bits,
            getRobotStatus=lambda: POWERED,
            getRobotMode=lambda: RUNNING,
            getActualQ=lambda: [0.0] * 6,
            getTargetQd=lambda: [0.0] * 6,
        )

    def timestamp(self):
        self.reads += 1
        return 0.016 * self.package()

    def package(self):
        return self.reads // self.READS_A_PACKAGE

    def safety_bits(self):
        told = self.stopped_at is not None and self.package() >= self.stopped_at + 2
        return self.PROTECTIVE_STOP if told else self.NORMAL

    def stop(self):
        self.running, self.stopped_at = False, self.package()


@pytest.fixture
def controller(monkeypatch):
    behind = Controller()
    for client in ("DashboardClient", "RTDEReceiveInterface", "RTDEControlInterface"):
        monkeypatch.setattr(arm, client, lambda *_: behind.clients())
    return behind


def test_a_program_that_a_safety_stop_ended_is_told_with_that_stop(controller):
    connected = arm.ConnectedArm("robot", "here")
    assert connected.state().safety is Safety.normal
    controller.stop()
    assert connected.progress().state.safety is Safety.protective_stop


def test_a_program_that_a_person_ended_is_told_after_a_few_packages(controller):
    connected = arm.ConnectedArm("robot", "here")
    controller.running = False
    progress = connected.progress()
    assert (progress.state.safety, progress.program_running) == (Safety.normal, False)

"""Driver of a robot over Modbus TCP: what the service calls.

Plain `pymodbus` in this very thread: the heartbeat goes out only while `move` is being run through,
so whatever holds up, freezes or kills this process stops the robot, by the watchdog in the
controller. A command is sent once; what is asked again are readings.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from drivers.addresses import Address
from drivers.devices.modbus.contract import CHECK_WORD, SEQUENCES, Contract, Status
from drivers.errors import Interrupted, NoReply, Refused, Unsafe
from drivers.interfaces import (
    MAY_MOVE,
    STOP_DECELERATION,
    JointMotion,
    RobotState,
    Safety,
    nobody_looks,
)
from drivers.modbus_link import over_tcp
from drivers.transport import read_again

PROFILE = "generic"
REPLY_TIMEOUT_S = 0.5
POLL_S = 0.02
"""Twice as often as `may_continue` has to be asked, ten times within the watchdog."""
ACCEPT_S = 0.5
"""Longest time for which the controller may overlook a command [s]."""
STALE_S = 0.5
"""Longest time for which the controller's counter may stand still [s]."""
REST_S = 2.0
"""Longest time for coming to rest [s]."""
ARRIVAL_TOLERANCE = 1e-3
"""[rad], [m] Far above a robot's positioning error, far below any planned motion."""

ADVICE = {
    Safety.protective_stop: "find what it touched or why it was overloaded, clear the way, then "
    "acknowledge the stop at the controller",
    Safety.emergency_stop: "make the cell safe, release the emergency stop, switch the arm on",
    Safety.safeguard_stop: "leave the safeguarded area and reset the safeguard",
    Safety.fault: "read the fault at the controller and restart it",
    Safety.not_ready: "switch the arm on and start the robot's program in automatic mode",
}


class ModbusRobot:
    """A robot whose controller's program follows a register contract.

    Parameters
    ----------
    address
        ``host:port``; option `profile`, a name (generic, staubli_cs9) or the path of one's own.
    n_joints
        Joints of the robot model that the cell was set up with.
    reply_timeout_s
        Longest wait for a reply [s].

    Raises
    ------
    Refused
        If the profile is wrong, or reads joints too coarsely for calibration.
    """

    def __init__(
        self, address: str, n_joints: int, *, reply_timeout_s: float = REPLY_TIMEOUT_S
    ) -> None:
        self._device = f"robot modbus at {address}"
        where = Address(self._device, address, "profile")
        self._contract = Contract(self._device, where.word("profile", PROFILE), n_joints)
        self._n_joints = n_joints
        self._link = over_tcp(self._device, where.place, self._contract.unit, reply_timeout_s)
        self._counter: int | None = None
        self._counted_s = 0.0
        self._beats = 0

    def connect(self) -> None:
        """Open the connection and check that the controller keeps the contract.

        Raises
        ------
        Unreachable, NoReply
            Nobody listens or answers, or the controller's counter stands still.
        Refused
            Word order, number of joints or registers differ from the profile, or the robot moves
            on another program's command.
        Unsafe
            The robot is not in a state in which it may move.
        """
        self._link.open()
        self._counter = None
        try:
            status = self._fresh()
            self._require_safe("connect", status)
            self._require_idle(status)
        except BaseException:
            self._link.close()
            raise

    def state(self) -> RobotState:
        """Read the status registers in one request.

        Raises
        ------
        NoReply
            No reply, or the controller's counter stands still, so the values are old.
        """
        status = self._fresh()
        safety = self._contract.safety(status)
        return RobotState(
            status.joints, status.busy, safety, ADVICE.get(safety, ""), status.clock_s
        )

    def move(
        self,
        motion: JointMotion,
        may_continue: Callable[[], bool],
        seen: Callable[[tuple[float, ...]], None] = nobody_looks,
    ) -> None:
        """Send one motion command and follow it to its end; see `drivers.interfaces.Robot`.

        Raises
        ------
        Unsafe
            A stop of the safety system, before or during the motion.
        Refused
            A target or speed that the controller declines, or it stopped by itself.
        Interrupted
            `may_continue` said no; the robot stands.
        NoReply, BadReply, Unreachable
            Not there within the deadline, or the connection is lost: without a heartbeat the
            controller stops the robot.
        """
        deadline_s = time.monotonic() + motion.deadline_s
        status = self._fresh()
        self._require_safe("move", status)
        sequence = (status.accepted + 1) % SEQUENCES
        block = self._contract.move_block(sequence, motion)
        try:
            self._ask_permission(may_continue)
            self._link.write("move", self._contract.command_places.start, block)
            self._await_acceptance(sequence)
            self._follow(sequence, motion, deadline_s, may_continue, seen)
        except BaseException:
            # A lost connection is closed already: the heartbeat has ended, the watchdog stops it.
            if self._link.is_open:
                self.stop()
            raise

    def stop(self) -> None:
        """Stop the robot and wait until it stands; harmless where it stands already."""
        if not self._link.wanted:
            return
        read_again(self._send_stop)
        end_s = time.monotonic() + REST_S
        while read_again(self._look).busy:
            if time.monotonic() > end_s:
                raise NoReply(
                    self._device,
                    "stop",
                    f"the robot still moves after {REST_S:g} s: press the emergency stop",
                )
            time.sleep(POLL_S)

    def close(self) -> None:
        """Stop the robot if it moves and let go of it."""
        try:
            if self._link.is_open and read_again(self._look).busy:
                self.stop()
        finally:
            self._link.close()

    def _look(self) -> Status:
        places = self._contract.status_places
        block = self._link.read(
            "read status", self._contract.status_table, places.start, len(places)
        )
        status = self._contract.decode(block)
        self._check(status, block)
        return status

    def _check(self, status: Status, block: tuple[int, ...]) -> None:
        if status.check != CHECK_WORD:
            raise Refused(
                self._device,
                "read status",
                f"the check word reads {status.check:#010x} and not {CHECK_WORD:#010x}; correct "
                "word order and addresses in the profile, or start the robot's program",
                b"".join(word.to_bytes(2, "big") for word in block),
            )
        if status.n_joints != self._n_joints:
            raise Refused(
                self._device,
                "read status",
                f"the robot there has {status.n_joints} joints, the cell's model has "
                f"{self._n_joints}; choose the model that fits the robot",
            )

    def _fresh(self) -> Status:
        """Look until the controller's counter has moved since the last look."""
        end_s = time.monotonic() + STALE_S
        while True:
            status = read_again(self._look)
            if self._moves_on(status):
                return status
            if time.monotonic() > end_s:
                raise self._stale()
            time.sleep(POLL_S / 4)

    def _moves_on(self, status: Status) -> bool:
        if self._counter is None:
            # A first look says nothing about whether the counter moves.
            self._counter = status.counter
            return False
        if status.counter == self._counter:
            return False
        self._counter, self._counted_s = status.counter, time.monotonic()
        return True

    def _stale(self) -> NoReply:
        self._link.drop()
        return NoReply(
            self._device,
            "read status",
            f"the controller's counter stands still for {STALE_S:g} s, so its values are old; "
            "start the robot's program again",
        )

    def _await_acceptance(self, sequence: int) -> None:
        end_s = time.monotonic() + ACCEPT_S
        while self._watch().accepted != sequence:
            if time.monotonic() > end_s:
                raise NoReply(
                    self._device,
                    "move",
                    f"the controller did not look at the command within {ACCEPT_S:g} s; start the "
                    "robot's program in automatic mode",
                )
            time.sleep(POLL_S / 4)

    def _follow(
        self,
        sequence: int,
        motion: JointMotion,
        deadline_s: float,
        may_continue: Callable[[], bool],
        seen: Callable[[tuple[float, ...]], None],
    ) -> None:
        while True:
            self._ask_permission(may_continue)
            self._beat()
            status = self._watch()
            seen(status.joints)
            self._require_safe("move", status)
            self._require_own(sequence, status)
            if status.done == sequence and not status.busy:
                self._require_arrival(motion.joints, status)
                return
            if time.monotonic() > deadline_s:
                raise NoReply(
                    self._device,
                    "move",
                    f"not there within {motion.deadline_s:g} s and stopped: allow more time or a "
                    "higher speed",
                )
            time.sleep(POLL_S)

    def _watch(self) -> Status:
        """Look once during a motion; nothing is asked again, so that the heartbeat stays true."""
        status = self._look()
        if not self._moves_on(status) and time.monotonic() - self._counted_s > STALE_S:
            raise self._stale()
        return status

    def _beat(self) -> None:
        self._beats = (self._beats + 1) % SEQUENCES
        self._link.write("heartbeat", self._contract.heartbeat.address, [self._beats])

    def _send_stop(self) -> None:
        sequence = (self._look().accepted + 1) % SEQUENCES
        block = self._contract.stop_block(sequence, STOP_DECELERATION)
        self._link.write("stop", self._contract.command_places.start, block)

    def _ask_permission(self, may_continue: Callable[[], bool]) -> None:
        if not may_continue():
            raise Interrupted(self._device, "move", "stopped, the caller no longer wants it")

    def _require_idle(self, status: Status) -> None:
        if status.busy:
            raise Refused(
                self._device, "connect", "the robot moves on another program's command; stop it"
            )

    def _require_safe(self, command: str, status: Status) -> None:
        safety = self._contract.safety(status)
        if safety not in MAY_MOVE:
            raise Unsafe(self._device, command, f"{safety}: {ADVICE[safety]}")

    def _require_own(self, sequence: int, status: Status) -> None:
        if status.accepted != sequence:
            raise Refused(
                self._device,
                "move",
                f"another program gave command {status.accepted} during command {sequence}; let "
                "only one program drive the robot",
            )
        if status.error:
            raise Refused(self._device, "move", self._contract.explain(status.error))

    def _require_arrival(self, target: tuple[float, ...], status: Status) -> None:
        miss = max(abs(q - goal) for q, goal in zip(status.joints, target, strict=True))
        if miss > ARRIVAL_TOLERANCE:
            raise Refused(
                self._device,
                "move",
                f"the robot stands {miss:.4f} rad or m from its target; read the controller's log",
            )

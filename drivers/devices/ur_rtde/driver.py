"""Driver of a UR arm: what the service calls.

Speaks to a child process that holds the `ur_rtde` clients, because their constructors stop the
whole Python process without a time limit and their reconnect is broken (ur_rtde 1.6.5). Nothing
is ever reconnected: after a loss the child is killed, and `connect` starts a new one.
"""

import math
import time
from collections.abc import Callable

from drivers.errors import Interrupted, NoReply, Refused, Unreachable, Unsafe
from drivers.interfaces import MAY_MOVE, JointMotion, RobotState, nobody_looks

from .messages import AskProgress, AskState, Done, Progress, StartMotion, StopMotion
from .probe import probe
from .session import Session

N_JOINTS = 6
CONNECT_DEADLINE_S = 10.0
"""The client library itself waits 5 s for the control program to start."""
START_DEADLINE_S = 6.0
"""For uploading the control program again where a stop has ended it."""
REPLY_DEADLINE_S = 1.0
STOP_DEADLINE_S = 4.0
POLL_PERIOD_S = 0.02
"""Twice as often as `may_continue` has to be asked, and well within the child's patience."""


class UrRtde:
    """A UR arm of PolyScope 3 or 5 (CB3, e-series) at an address.

    Parameters
    ----------
    address
        Host name or IP address of the controller; the ports are fixed (30004, 29999, 30003).
    n_joints
        Joints of the robot model that the cell was set up with.
    connect_deadline_s
        For starting the control program in the controller [s].

    Raises
    ------
    Refused
        If `n_joints` is not six.
    """

    def __init__(
        self, address: str, n_joints: int = N_JOINTS, connect_deadline_s: float = CONNECT_DEADLINE_S
    ) -> None:
        self._address = address
        self._device = f"robot ur_rtde at {address}"
        self._connect_deadline_s = connect_deadline_s
        self._session: Session | None = None
        if n_joints != N_JOINTS:
            raise Refused(
                self._device,
                "configure",
                f"a UR has {N_JOINTS} joints and the cell's robot model has {n_joints}: "
                "choose this arm's model",
            )

    @property
    def child_pid(self) -> int | None:
        """Process number of the child, None while not connected."""
        return self._session.pid if self._session is not None and self._session.alive else None

    def connect(self) -> None:
        """Start the child and the control program; check remote control and safety state.

        Raises
        ------
        Unreachable
            No controller answers, or it hangs.
        Refused
            The pendant is in local control, or another program controls the robot.
        Unsafe
            The robot is not in a state in which it may move.
        """
        self.close()
        probe(self._device, self._address)
        self._session = Session(self._device, self._address, self._connect_deadline_s)

    def state(self) -> RobotState:
        """Read ``actual_q``, motion, safety and the controller's clock.

        Raises
        ------
        NoReply
            The connection is lost, or the controller's clock stands still.
        """
        return self._open_session().ask(AskState(), RobotState, REPLY_DEADLINE_S)

    def move(
        self,
        motion: JointMotion,
        may_continue: Callable[[], bool],
        seen: Callable[[tuple[float, ...]], None] = nobody_looks,
    ) -> None:
        """Send one asynchronous moveJ and follow it to its end.

        The child stops the arm by itself when it is not asked for progress for 0.15 s, and the
        watchdog in the controller stops it when the child is gone. So `may_continue` has to
        answer within about 0.1 s.

        Raises
        ------
        Unsafe
            A stop of the safety system, before or during the motion.
        Refused
            Local control, a target or speed that the controller declines, a program stop.
        Interrupted
            `may_continue` said no; the arm stands.
        NoReply
            Not there within the deadline, or the connection is lost.
        """
        session = self._open_session()
        self._check(motion)
        end_s = time.monotonic() + motion.deadline_s
        arrived = False
        try:
            self._ask_permission(may_continue)
            request = StartMotion(motion.joints, motion.speed, motion.acceleration)
            session.ask(request, Done, START_DEADLINE_S)
            while not arrived:
                self._ask_permission(may_continue)
                progress = session.ask(AskProgress(), Progress, REPLY_DEADLINE_S)
                seen(progress.state.joints)
                self._require_progress(progress, end_s, motion.deadline_s)
                arrived = progress.arrived
                if not arrived:
                    time.sleep(POLL_PERIOD_S)
        finally:
            if not arrived:
                self.stop()

    def stop(self) -> None:
        """Stop the arm with a synchronous stopJ and wait until it stands.

        Raises
        ------
        NoReply
            The connection is lost; the watchdog in the controller stops the arm.
        """
        if self._session is not None and self._session.alive:
            self._session.ask(StopMotion(), Done, STOP_DEADLINE_S)

    def close(self) -> None:
        """Stop the arm and its control program, and end the child."""
        if self._session is not None:
            self._session.close()
            self._session = None

    def _open_session(self) -> Session:
        if self._session is None or not self._session.alive:
            raise Unreachable(self._device, "use", "not connected: connect first")
        return self._session

    def _check(self, motion: JointMotion) -> None:
        numbers = (*motion.joints, motion.speed, motion.acceleration)
        if len(motion.joints) != N_JOINTS or not all(math.isfinite(number) for number in numbers):
            raise Refused(
                self._device,
                "moveJ",
                f"needs {N_JOINTS} finite joint readings, speed and acceleration, got {motion}",
            )

    def _ask_permission(self, may_continue: Callable[[], bool]) -> None:
        if not may_continue():
            raise Interrupted(self._device, "moveJ", "stopped, the caller no longer wants it")

    def _require_progress(self, progress: Progress, end_s: float, deadline_s: float) -> None:
        safety = progress.state.safety
        if safety not in MAY_MOVE:
            raise Unsafe(
                self._device, "moveJ", f"{safety} during the motion: {progress.state.advice}"
            )
        if not progress.program_running:
            raise Refused(
                self._device,
                "moveJ",
                "the control program was stopped during the motion, by a person at the pendant or "
                "by the controller (target out of reach, watchdog): look at the pendant's log",
            )
        if not progress.arrived and time.monotonic() > end_s:
            raise NoReply(
                self._device,
                "moveJ",
                f"not there within {deadline_s:g} s and stopped: allow more time or a higher speed",
            )

"""A UR arm through the three `ur_rtde` clients. Lives in the child process only.

Register protocol and pitfalls of ur_rtde 1.6.5: only asynchronous moveJ (a synchronous one cannot
be interrupted), only synchronous stopJ (an asynchronous one changes the kind of all later stops),
failure is a returned False, and values go stale without an error.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager

from dashboard_client import DashboardClient
from rtde_control import RTDEControlInterface
from rtde_receive import RTDEReceiveInterface

from drivers.errors import NoReply, Refused, Unreachable, Unsafe
from drivers.interfaces import MAY_MOVE, STOP_DECELERATION, RobotState

from .messages import Progress, StartMotion
from .safety import advice, safety_state

CONTROL_HZ = 125.0
"""A command takes about two cycles."""
RECEIVE_HZ = 62.5
"""Joints are read at rest, so fewer packages do and spare computing time."""
VARIABLES = [
    "timestamp",
    "actual_q",
    "target_qd",
    "robot_mode",
    "safety_status_bits",
    "robot_status_bits",
]
WATCHDOG_HZ = 7.0
"""The controller stops the program 0.14 s after the last kick; some take up to two periods."""
KICK_PERIOD_S = 0.02
STALE_S = 0.5
"""Longest time for which the controller's clock may seem to stand still [s]."""
CAUSE_PACKAGES = 3
"""One may be on its way when the program ends, and the safety state be set a cycle later."""
REST_DEADLINE_S = 2.0
PROGRAM_START_DEADLINE_S = 3.0
WAIT_PERIOD_S = 0.005
TARGET_TOLERANCE = 1e-3
"""[rad] Far above a UR's positioning error, far below any planned motion."""
SHORT_OF_TARGET_S = 1.0
"""A motion that stands still for so long without having arrived has ended early [s]."""
REMOTE_CONTROL_SINCE = (5, 6)
"""PolyScope version that brought remote control."""


class ConnectedArm:
    """The three clients, connected, with the watchdog in the controller armed."""

    def __init__(self, device: str, address: str) -> None:
        self.device = device
        self._target: tuple[float, ...] | None = None
        self._abandoned: NoReply | None = None
        self._kicked_s = self._still_since_s = self._clock_moved_s = time.monotonic()
        self._clock_s = 0.0
        try:
            self._dashboard = DashboardClient(address)
            self._dashboard.connect()
            self._receive = RTDEReceiveInterface(address, RECEIVE_HZ, VARIABLES)
        except RuntimeError as error:
            raise Unreachable(device, "connect", f"{error}: check the controller") from error
        self._has_remote_control = self._version() >= REMOTE_CONTROL_SINCE
        self._check_may_start("connect")
        self._control = self._open_control(address)
        self._arm_watchdog()

    @property
    def in_motion(self) -> bool:
        """Whether a motion was started that has not ended yet."""
        return self._target is not None

    def connected(self) -> bool:
        """Whether both RTDE connections stand. May be called from another thread."""
        return bool(self._receive.isConnected() and self._control.isConnected())

    def lost(self, how: str) -> NoReply:
        """Describe the loss of the connection."""
        return NoReply(
            self.device, "RTDE", f"{how}: check power and cable of the controller, connect again"
        )

    def state(self) -> RobotState:
        """Read one data package.

        Raises
        ------
        NoReply
            The values are old.
        """
        self._check_clock()
        while True:
            time_s = self._receive.getTimestamp()
            joints = tuple(self._receive.getActualQ())
            moving = any(self._receive.getTargetQd())
            safety = safety_state(
                self._receive.getSafetyStatusBits(),
                self._receive.getRobotStatus(),
                self._receive.getRobotMode(),
            )
            if self._receive.getTimestamp() == time_s:
                return RobotState(joints, moving, safety, advice(safety), time_s)

    def start(self, motion: StartMotion) -> None:
        """Start one asynchronous moveJ, after all checks.

        Raises
        ------
        Unsafe, Refused
            The arm may not move, or the controller does not take the motion.
        """
        self._abandoned = None
        self._check_may_start("moveJ")
        # The dashboard may have taken its time.
        self.keep_alive()
        if not self._control.isProgramRunning():
            self._upload_again()
        with self._command("moveJ"):
            try:
                taken = self._control.moveJ(
                    list(motion.joints), motion.speed, motion.acceleration, asynchronous=True
                )
            except ValueError as error:
                raise Refused(self.device, "moveJ", f"{error}") from error
        if not taken:
            self._why_ended(self.state())
            self._check_may_start("moveJ")
            raise Refused(
                self.device,
                "moveJ",
                "the controller did not take the motion (target out of reach, a stop at the "
                "pendant, or the watchdog of an overloaded machine): see the pendant's log",
            )
        self._target = motion.joints
        self._still_since_s = time.monotonic()

    def progress(self) -> Progress:
        """Look how the motion goes.

        Raises
        ------
        NoReply
            The motion was abandoned, or the values are old.
        Refused
            The arm stands, but not at the target.
        """
        if self._abandoned is not None:
            raise self._abandoned
        state = self.state()
        running = bool(self._control.isProgramRunning())
        if not running:
            state = self._why_ended(state)
        if state.safety not in MAY_MOVE or not running:
            return Progress(state, arrived=False, program_running=running)
        return Progress(state, arrived=self._has_arrived(state), program_running=True)

    def stop(self) -> None:
        """Stop the arm and wait until it stands.

        Raises
        ------
        NoReply
            It does not come to rest.
        """
        self._target = None
        if self._control.isProgramRunning():
            with self._command("stopJ"):
                self._control.stopJ(STOP_DECELERATION)
        deadline_s = time.monotonic() + REST_DEADLINE_S
        while self.state().moving:
            if time.monotonic() > deadline_s:
                raise NoReply(
                    self.device,
                    "stopJ",
                    f"the arm still moves after {REST_DEADLINE_S:g} s: press the emergency stop",
                )
            time.sleep(WAIT_PERIOD_S)

    def abandon(self, silent_s: float) -> None:
        """Stop a motion whose driver no longer asks, and remember why."""
        self.stop()
        self._abandoned = NoReply(
            self.device,
            "moveJ",
            f"stopped, because this program did not look after the motion for {silent_s:.2f} s: "
            "the machine is overloaded or something holds the program up",
        )

    def keep_alive(self) -> None:
        """Kick the watchdog where one is due, and notice a standing clock."""
        self._check_clock()
        due = time.monotonic() - self._kicked_s >= KICK_PERIOD_S
        if due and self._control.isProgramRunning():
            with self._command("kickWatchdog"):
                self._control.kickWatchdog()

    def release(self) -> None:
        """Stop arm and program, and leave the rest to the end of the process."""
        if self.in_motion:
            self.stop()
        if self._control.isProgramRunning():
            with self._command("stop script"):
                self._control.stopScript()

    def _why_ended(self, state: RobotState) -> RobotState:
        """Wait for the safety state that ended the program: another connection brings it, later."""
        for _ in range(CAUSE_PACKAGES):
            seen_s = state.time_s
            while state.safety in MAY_MOVE and state.time_s == seen_s:
                time.sleep(WAIT_PERIOD_S)
                state = self.state()
        return state

    def _has_arrived(self, state: RobotState) -> bool:
        target = self._target
        now_s = time.monotonic()
        if target is None or state.moving or self._async_running():
            self._still_since_s = now_s
            return False
        distance = max(abs(q - goal) for q, goal in zip(state.joints, target, strict=True))
        if distance < TARGET_TOLERANCE:
            arrived = self._steady()
            self._target = None if arrived else target
            return arrived
        if now_s - self._still_since_s > SHORT_OF_TARGET_S:
            raise Refused(
                self.device,
                "moveJ",
                f"the arm stands {distance:.4f} rad from its target: see the pendant's log",
            )
        return False

    def _async_running(self) -> bool:
        return bool(self._control.getAsyncOperationProgressEx().isAsyncOperationRunning())

    def _steady(self) -> bool:
        with self._command("isSteady"):
            return bool(self._control.isSteady())

    def _check_clock(self) -> None:
        clock_s, now_s = self._receive.getTimestamp(), time.monotonic()
        if clock_s != self._clock_s:
            self._clock_s, self._clock_moved_s = clock_s, now_s
        elif now_s - self._clock_moved_s > STALE_S:
            raise self.lost(f"the controller's clock stands still for {STALE_S:g} s")

    def _check_may_start(self, command: str) -> None:
        state = self.state()
        if state.safety not in MAY_MOVE:
            raise Unsafe(self.device, command, f"{state.safety}: {state.advice}")
        if self._has_remote_control:
            with self._client_errors("is in remote control"):
                remote = self._dashboard.isInRemoteControl()
            if not remote:
                raise Refused(
                    self.device,
                    command,
                    "the robot is in local control: switch it to remote control on the pendant",
                )

    def _version(self) -> tuple[int, ...]:
        with self._client_errors("PolyscopeVersion"):
            text: str = self._dashboard.polyscopeVersion()
        return tuple(int(number) for number in text.split(".")[:2])

    def _open_control(self, address: str) -> RTDEControlInterface:
        try:
            return RTDEControlInterface(address, CONTROL_HZ)
        except RuntimeError as error:
            if "already in use" in str(error):
                raise Refused(
                    self.device, "connect", "another program controls this robot: close it first"
                ) from error
            raise Refused(self.device, "connect", f"{error}: see the pendant's log") from error

    def _arm_watchdog(self) -> None:
        with self._command("setWatchdog"):
            armed = self._control.setWatchdog(WATCHDOG_HZ)
        if not armed:
            raise NoReply(self.device, "setWatchdog", "the control program does not answer")

    def _upload_again(self) -> None:
        with self._command("reuploadScript"):
            self._control.reuploadScript()
        deadline_s = time.monotonic() + PROGRAM_START_DEADLINE_S
        while not self._control.isProgramRunning():
            if time.monotonic() > deadline_s:
                raise Refused(
                    self.device,
                    "upload",
                    f"the control program did not start within {PROGRAM_START_DEADLINE_S:g} s: "
                    "close the pop-ups on the pendant and see its log",
                )
            time.sleep(WAIT_PERIOD_S)
        self._arm_watchdog()

    @contextmanager
    def _command(self, command: str) -> Iterator[None]:
        with self._client_errors(command):
            yield
        # Every command writes the watchdog's register. A kick in the two cycles behind one would
        # also make the library wait for up to 3 s where the program ends just then.
        self._kicked_s = time.monotonic()

    @contextmanager
    def _client_errors(self, command: str) -> Iterator[None]:
        try:
            yield
        except RuntimeError as error:
            raise NoReply(self.device, command, f"{error}: connect again") from error

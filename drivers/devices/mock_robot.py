"""Robot of the emulated world, without any robot's wire: one plain socket to the world.

For work above the drivers, for speed, and for systems without the UR client library. Chosen by
name in a cell's settings; no other driver falls back to it.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from drivers.errors import BadReply, Interrupted, NoReply, Refused, Unsafe
from drivers.interfaces import (
    MAY_MOVE,
    STOP_DECELERATION,
    JointMotion,
    RobotState,
    Safety,
    nobody_looks,
)
from drivers.transport import JsonReply, LineSocket, ask_json, read_again

REPLY_TIMEOUT_S = 2.0
POLL_S = 0.02
"""Longest wait between two looks at a moving robot; the interface allows 0.05 [s]."""
ARRIVAL_TOLERANCE = 1e-6
"""Largest distance of a joint from its target that counts as arrived [rad], [m]."""

ADVICE = {
    Safety.normal: "",
    Safety.reduced: "",
    Safety.protective_stop: "Clear the cause of the stop and set the world's safety to normal.",
    Safety.emergency_stop: "Release the emergency stop and set the world's safety to normal.",
    Safety.safeguard_stop: "Close the safeguard and set the world's safety to normal.",
    Safety.fault: "Restart the emulated world.",
    Safety.not_ready: "Set the world's safety to normal.",
}


class MockRobot:
    """A robot of `n_joints` joints at ``host:port`` of an emulated world."""

    def __init__(self, address: str, n_joints: int) -> None:
        self._device = f"robot mock at {address}"
        self._n_joints = n_joints
        self._line = LineSocket(self._device, address, REPLY_TIMEOUT_S)
        self._time_scale = 1.0

    def connect(self) -> None:
        """Open the socket and compare the number of joints."""
        self._line.open()
        hello = read_again(lambda: self._ask("hello"))
        if hello.number("n_joints") != self._n_joints:
            raise Refused(
                self._device,
                "hello",
                f"the robot there has {hello.number('n_joints'):g} joints, the cell's model has "
                f"{self._n_joints}; choose the model that fits the robot",
            )
        self._time_scale = hello.number("time_scale")

    def state(self) -> RobotState:
        """Read joints, motion and safety state once."""
        return read_again(self._read_state)

    def _read_state(self) -> RobotState:
        reply = self._ask("robot")
        word = reply.word("safety")
        if word not in set(Safety):
            raise BadReply(self._device, "robot", f"safety state {word!r} is unknown", reply.raw)
        safety = Safety(word)
        return RobotState(
            reply.numbers("joints"),
            reply.yes("moving"),
            safety,
            ADVICE[safety],
            reply.number("time_s"),
        )

    def move(
        self,
        motion: JointMotion,
        may_continue: Callable[[], bool],
        seen: Callable[[tuple[float, ...]], None] = nobody_looks,
    ) -> None:
        """Drive to the target and return on arrival; see `drivers.interfaces.Robot`."""
        self._require_safe(self.state())
        deadline = time.monotonic() + motion.deadline_s
        arrived = False
        try:
            expected_s = self._start(motion)
            self._follow(motion.joints, expected_s, deadline, may_continue, seen)
            arrived = True
        finally:
            if not arrived:
                self.stop()

    def _start(self, motion: JointMotion) -> float:
        """Start the motion and return how long it will take here [s]."""
        reply = self._ask(
            "move",
            joints=motion.joints,
            speed=motion.speed,
            acceleration=motion.acceleration,
            stop_on_disconnect=True,
        )
        return reply.part("segment").number("duration_s") / self._time_scale

    def _follow(
        self,
        target: tuple[float, ...],
        expected_s: float,
        deadline: float,
        may_continue: Callable[[], bool],
        seen: Callable[[tuple[float, ...]], None],
    ) -> None:
        arrival = time.monotonic() + expected_s
        while True:
            if not may_continue():
                raise Interrupted(self._device, "move", "the motion was stopped on request")
            state = self.state()
            seen(state.joints)
            self._require_safe(state)
            if not state.moving:
                self._require_arrival(target, state)
                return
            now = time.monotonic()
            if now >= deadline:
                raise NoReply(
                    self._device, "move", "not arrived in time; check speed and time limit"
                )
            time.sleep(min(POLL_S, max(arrival - now, 0.0005)))

    def _require_safe(self, state: RobotState) -> None:
        if state.safety not in MAY_MOVE:
            raise Unsafe(self._device, "move", f"safety state {state.safety.value}. {state.advice}")

    def _require_arrival(self, target: tuple[float, ...], state: RobotState) -> None:
        miss = max(abs(a - b) for a, b in zip(target, state.joints, strict=True))
        if miss > ARRIVAL_TOLERANCE:
            raise Unsafe(
                self._device,
                "move",
                f"the robot stands still {miss:.3g} rad away from the target; something else "
                "stopped it, or the connection was lost on the way",
            )

    def stop(self) -> None:
        """Stop the robot."""
        read_again(lambda: self._ask("stop", acceleration=STOP_DECELERATION))

    def close(self) -> None:
        """Stop the robot if it moves and close the socket."""
        try:
            if self._line.wanted and self.state().moving:
                self.stop()
        finally:
            self._line.close()

    def _ask(self, operation: str, **arguments: object) -> JsonReply:
        reply = ask_json(self._line, self._device, operation, {"op": operation, **arguments})
        if reply.yes("ok"):
            return reply
        kind = Unsafe if reply.word("error") == "unsafe" else Refused
        raise kind(self._device, operation, reply.word("message"))

"""The driver's side of one child process: start it, ask it with deadlines, kill it.

The client library can hang for ever, reconnect in a storm and crash; a process of its own is the
only thing that always ends.
"""

import subprocess
import sys
from contextlib import suppress
from typing import TypeVar

from drivers.errors import BadReply, DriverError, NoReply, Refused, Unreachable, Unsafe

from .messages import Done, Inbox, Outbox

CHILD = "drivers.devices.ur_rtde.child"
CLOSE_DEADLINE_S = 3.0
"""For stopping the arm and the control program before the child is killed."""

Reply = TypeVar("Reply")


class Session:
    """One life of the child process. After any loss it is over and a new one is needed."""

    def __init__(self, device: str, address: str, connect_deadline_s: float) -> None:
        self._device = device
        # A session of its own: Ctrl-C at a terminal must not end the child before the driver
        # has stopped the arm through it.
        self._process = subprocess.Popen(
            [sys.executable, "-m", CHILD, address, device, str(connect_deadline_s)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._stdin = self._process.stdin
        self._outbox = Outbox(self._process.stdin)
        self._inbox = Inbox(self._process.stdout)
        self.alive = True
        self._await_connection(connect_deadline_s)

    @property
    def pid(self) -> int:
        """Process number of the child."""
        return self._process.pid

    def ask(self, request: object, answer: type[Reply], deadline_s: float) -> Reply:
        """Send a request and wait for its answer.

        Raises
        ------
        NoReply
            The child has ended or does not answer; it was killed and the session is over.
        DriverError
            What the child reports; the session goes on for `Refused` and `Unsafe`.
        """
        command = type(request).__name__
        try:
            # A child that has ended may have left its reason in the inbox.
            with suppress(BrokenPipeError):
                self._outbox.send(request)
            return self._expect(answer, command, deadline_s)
        except (Refused, Unsafe):
            raise
        except BaseException:
            # Also after Ctrl-C: the answer that is still under way would be taken for the next.
            self.kill()
            raise

    def close(self) -> None:
        """End the child, which stops arm and program before it goes."""
        if not self.alive:
            return
        # Closing its standard input is the whole message: the death of this program says the same.
        self._stdin.close()
        try:
            self._process.wait(CLOSE_DEADLINE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
        self._bury()

    def kill(self) -> None:
        """Kill the child; the watchdog in the controller stops the arm."""
        self._process.kill()
        self._bury()

    def _bury(self) -> None:
        self.alive = False
        self._process.wait()
        self._inbox.join()
        if not self._stdin.closed:
            # Nothing is buffered: every message was flushed or lost with the child.
            self._stdin.raw.close()  # type: ignore[attr-defined]

    def _await_connection(self, deadline_s: float) -> None:
        try:
            self._expect(Done, "connect", deadline_s)
        except NoReply as error:
            self.kill()
            raise Unreachable(
                self._device,
                "connect",
                f"the controller did not take the control program within {deadline_s:g} s "
                f"({error.reason}): restart the controller and connect again",
            ) from error
        except BaseException:
            self.kill()
            raise

    def _expect(self, answer: type[Reply], command: str, deadline_s: float) -> Reply:
        try:
            reply = self._inbox.take(deadline_s)
        except EOFError:
            status = self._process.wait()
            reason = f"the client process ended with status {status}: connect again"
            raise NoReply(self._device, command, reason) from None
        if isinstance(reply, DriverError):
            raise reply
        if reply is None:
            reason = f"the client process gave no answer within {deadline_s:g} s: connect again"
            raise NoReply(self._device, command, reason)
        if not isinstance(reply, answer):
            raise BadReply(self._device, command, f"the client process answered {reply}")
        return reply

"""The process that holds the `ur_rtde` clients: ``python -m drivers.devices.ur_rtde.child``.

It answers the driver's requests and keeps three promises while the arm moves: the watchdog in the
controller is kicked only as long as the driver keeps asking; the arm is stopped when the driver
is silent or gone; and a lost connection ends this process at once, before the client library can
reconnect and send the interrupted motion again.
"""

import os
import signal
import sys
import threading
import time
from contextlib import suppress
from typing import NoReturn

from drivers.errors import BadReply, DriverError, NoReply

from .arm import ConnectedArm
from .messages import AskProgress, AskState, Done, Inbox, Outbox, StartMotion, StopMotion

TICK_S = 0.02
DRIVER_SILENCE_S = 0.15
"""Longest time without a request while the arm moves [s]."""
WATCH_PERIOD_S = 0.01
"""The client library needs 75 ms and more for a reconnect, so a loss cannot be missed."""
HURRY = -10
"""Added to the priority's number: less comes first."""
FAREWELL_S = 1.0
"""Time for stopping the arm after the driver has gone [s]."""


def main() -> None:
    """Connect, then serve until the driver closes the pipe."""
    address, device, connect_deadline_s = sys.argv[1:]
    if sys.platform != "win32":
        # Who looks after a moving arm goes before computations, where the system permits it.
        with suppress(PermissionError):
            os.nice(HURRY)
        # A hanging constructor holds the interpreter's lock, so only the kernel can end this
        # process where the driver has died meanwhile.
        signal.alarm(round(float(connect_deadline_s)) + 1)
    # The client library prints on standard output, which is the driver's pipe.
    outbox = Outbox(os.fdopen(os.dup(sys.stdout.fileno()), "wb"))
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    inbox = Inbox(sys.stdin.buffer)
    try:
        arm = ConnectedArm(device, address)
    except DriverError as error:
        _say_farewell(outbox, error)
    if sys.platform != "win32":
        signal.alarm(0)
    outbox.send(Done())
    threading.Thread(target=_watch, args=(arm, inbox, outbox), daemon=True, name="watch").start()
    Service(arm, inbox, outbox).run()


class Service:
    """Answers requests one after the other."""

    def __init__(self, arm: ConnectedArm, inbox: Inbox, outbox: Outbox) -> None:
        self._arm = arm
        self._inbox = inbox
        self._outbox = outbox
        self._heard_s = time.monotonic()

    def run(self) -> NoReturn:
        """Serve until the driver closes the pipe or the connection is lost."""
        try:
            while True:
                self._serve(self._inbox.take(TICK_S))
        except NoReply as error:
            _say_farewell(self._outbox, error)
        except (EOFError, BrokenPipeError):
            try:
                self._arm.release()
            finally:
                # Whatever went wrong, nobody is left to be told; the watchdog stops the arm.
                _leave(0)

    def _serve(self, request: object | None) -> None:
        if request is not None:
            self._outbox.send(self._answer(request))
            self._heard_s = time.monotonic()
        silent_s = time.monotonic() - self._heard_s
        if self._arm.in_motion and silent_s > DRIVER_SILENCE_S:
            self._arm.abandon(silent_s)
        self._arm.keep_alive()

    def _answer(self, request: object) -> object:
        try:
            match request:
                case AskState():
                    return self._arm.state()
                case StartMotion():
                    self._arm.start(request)
                case AskProgress():
                    return self._arm.progress()
                case StopMotion():
                    self._arm.stop()
                case _:
                    return BadReply(self._arm.device, "request", f"{request} is not known")
        except NoReply:
            raise
        except DriverError as error:
            return error
        return Done()


def _watch(arm: ConnectedArm, inbox: Inbox, outbox: Outbox) -> None:
    """End the process on a lost connection, or when it does not end by itself without a driver."""
    while not inbox.closed.wait(WATCH_PERIOD_S):
        if not arm.connected():
            _say_farewell(outbox, arm.lost("the controller has closed the connection"))
    time.sleep(FAREWELL_S)
    _leave(1)


def _say_farewell(outbox: Outbox, error: DriverError) -> NoReturn:
    with suppress(BrokenPipeError):
        outbox.send(error)
    _leave(1)


def _leave(status: int) -> NoReturn:
    # The library's destructors wait for each other; nothing of them is needed any more.
    os._exit(status)


if __name__ == "__main__":
    main()

"""What can go wrong between this program and a device.

`NoReply` and `BadReply` of an idempotent read may be retried (in `transport.py`, nowhere else);
a motion command is never retried.
"""


class DriverError(Exception):
    """A device did not do what it was asked.

    Parameters
    ----------
    device
        Name and address, as a person would look for it: ``robot ur_rtde at 127.0.0.2``.
    command
        What was asked: ``moveJ``, ``TMC_GetCoordinate``.
    reason
        What happened and what to do about it, one sentence.
    raw
        The bytes that came back, if any.
    """

    def __init__(self, device: str, command: str, reason: str, raw: bytes = b"") -> None:
        tail = f" (received {raw!r})" if raw else ""
        super().__init__(f"{device}: {command}: {reason}{tail}")
        self.device = device
        self.command = command
        self.reason = reason
        self.raw = raw

    def __reduce__(self) -> tuple[type, tuple[str, str, str, bytes]]:
        """Cross a process boundary whole."""
        return type(self), (self.device, self.command, self.reason, self.raw)


class Unreachable(DriverError):
    """No connection: switched off, unplugged, wrong address, or refused."""


class NoReply(DriverError):
    """Connected, but nothing came back in time."""


class BadReply(DriverError):
    """Something came back that is not what the protocol allows."""


class Refused(DriverError):
    """The device understood and declined: an error code, a mode, a limit."""


class Unsafe(DriverError):
    """The robot is not in a state in which it may move, or was stopped while moving."""


class Interrupted(DriverError):
    """The motion was stopped because the caller no longer wants it (abort, lost lease)."""

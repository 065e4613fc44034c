"""Universal Robots arms over RTDE, through the unmodified `ur_rtde` client in a child process."""

from .driver import UrRtde

__all__ = ["UrRtde"]

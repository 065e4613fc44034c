"""Universal Robots arms over RTDE, through the unmodified `ur_rtde` client in a child process."""

from importlib.util import find_spec

from .driver import UrRtde

__all__ = ["UrRtde"]

if find_spec("rtde_control") is None:
    # Only the child process imports the library; without this its absence would show there.
    raise ModuleNotFoundError("no module named 'rtde_control' (package ur-rtde)", name="ur-rtde")

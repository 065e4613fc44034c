"""NDI position sensors over a serial line, through `ndicapi` in a child process."""

from importlib.util import find_spec

from drivers.devices.ndi.tracker import NdiTracker

__all__ = ["NdiTracker"]

if find_spec("ndicapy") is None:
    # Only the child process imports the library; without this its absence would show there.
    raise ModuleNotFoundError("no module named 'ndicapy' (package ndicapi)", name="ndicapi")

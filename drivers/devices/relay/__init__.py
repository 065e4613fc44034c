"""Trackers whose host relays one line of text a measurement."""

from drivers.devices.relay.tracker import RelayTracker

__all__ = ["RelayTracker"]

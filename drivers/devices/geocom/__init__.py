"""Total stations that speak GeoCOM."""

from drivers.devices.geocom.tracker import Atmosphere, GeoComTracker

__all__ = ["Atmosphere", "GeoComTracker"]

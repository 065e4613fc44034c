"""The world's own clock: seconds since it began, `time_scale` times faster than real time."""

import time


class WorldClock:
    """A clock whose speed may change while it runs; it never jumps."""

    def __init__(self, time_scale: float) -> None:
        self._time_scale = time_scale
        self._real_start = time.monotonic()
        self._world_start = 0.0

    @property
    def time_scale(self) -> float:
        """World seconds per real second."""
        return self._time_scale

    def now(self) -> float:
        """World time [s]."""
        return self._world_start + (time.monotonic() - self._real_start) * self._time_scale

    def run_at(self, time_scale: float) -> None:
        """Go on from the present world time at another speed."""
        self._world_start = self.now()
        self._real_start = time.monotonic()
        self._time_scale = time_scale

"""The temperature probe of a cell, polled by a thread of its own while a campaign runs."""

import time
from threading import Lock
from typing import Self

from drivers.errors import DriverError, NoReply
from drivers.interfaces import TemperatureProbe, TemperatureReading
from service.background import Background

POLL_S = 1.0
STALE_S = 15.0
"""An older reading says nothing about now [s]; a probe has time for its own repeats."""


class PolledProbe(Background):
    """Context manager: connects the probe, and polls it until the end.

    Parameters
    ----------
    probe
        Used by the polling thread alone once that runs.
    """

    def __init__(self, probe: TemperatureProbe, poll_s: float = POLL_S) -> None:
        super().__init__("temperature")
        self._probe = probe
        self._poll_s = poll_s
        self._lock = Lock()
        self._latest: TemperatureReading | None = None
        self._error: DriverError | None = None

    def __enter__(self) -> Self:
        try:
            self._probe.connect()
            self._latest = self._probe.read()
        except BaseException:
            self._probe.close()
            raise
        return super().__enter__()

    def degc(self) -> float:
        """Return the latest temperature.

        Raises
        ------
        DriverError
            The probe failed, or has said nothing for long.
        """
        with self._lock:
            latest, error = self._latest, self._error
        if error is not None:
            raise error
        assert latest is not None
        age_s = time.monotonic() - latest.time_s
        if age_s > STALE_S:
            raise NoReply("temperature probe", "read", f"its last reading is {age_s:.0f} s old")
        return latest.temperature_degc

    def _run(self) -> None:
        try:
            while not self._over.wait(self._poll_s):
                self._look()
        finally:
            self._probe.close()

    def _look(self) -> None:
        try:
            reading = self._probe.read()
        except DriverError as error:
            # Told to the campaign at its next reading, and asked again: it may come back.
            with self._lock:
                self._error = error
            return
        with self._lock:
            self._latest, self._error = reading, None

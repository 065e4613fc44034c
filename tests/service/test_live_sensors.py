"""Sensors of the stage that are polled while somebody wants to know."""

import json
import time
from contextlib import closing

from service.base_calibrations import live
from tests.drivers.scripted_server import scripted_server

LONG_S = 60.0
REPLY = json.dumps({"ok": True, "value": 0.25, "time_s": 1.0}).encode() + b"\n"


def test_who_waits_gets_readings_although_one_takes_longer_than_nobody_asks(monkeypatch):
    monkeypatch.setattr(live, "IDLE_S", -1.0)
    with scripted_server(*[REPLY] * 50) as address:
        with closing(live.LiveSensor("slide", "mock", address)) as sensor:
            begun_s = time.monotonic()
            found = sensor.await_readings(3, begun_s, begun_s + LONG_S)
        assert [reading.value for reading in found] == [0.25] * 3

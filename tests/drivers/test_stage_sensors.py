"""Drivers of stage sensors and temperature probes on their own, against bytes of the manuals."""

import math
from pathlib import Path

import pytest
from scripted_station import exchanges, frames, scripted_station, scripted_unit

from drivers.devices.dimetix import ADVICE, DimetixRangefinder
from drivers.devices.lika import LikaEncoder
from drivers.devices.magnescale import MagnescaleGauge
from drivers.devices.modbus_temperature import ModbusTemperature
from drivers.errors import BadReply, Refused, Unreachable

TRANSCRIPTS = Path(__file__).parent / "transcripts"
DIMETIX = [(a, b + b"\r\n") for a, b in exchanges(TRANSCRIPTS / "dimetix.txt")]
MAGNESCALE = [(a, b + b"\r\n") for a, b in exchanges(TRANSCRIPTS / "magnescale.txt")]
LIKA = frames(TRANSCRIPTS / "lika.txt")


def rangefinder(port: str, **options) -> DimetixRangefinder:
    made = DimetixRangefinder(f"{port}?frame=8N1", "rod", reply_timeout_s=0.2, **options)
    made.connect()
    return made


def test_a_rangefinder_is_read_byte_for_byte():
    clear, measure, _ = DIMETIX
    with scripted_station([clear, measure]) as port:
        finder = rangefinder(port, shots=1)
        assert finder.read().value == pytest.approx(1.2345, abs=1e-12)
        finder.close()


def test_several_distances_are_averaged_with_their_spread():
    shots = [(b"s0g", b"g0g+0001%d\r\n" % tenths) for tenths in (2340, 2360, 2380)]
    with scripted_station([DIMETIX[0], *shots]) as port:
        finder = rangefinder(port, shots=3)
        reading = finder.read()
        finder.close()
    assert reading.value == pytest.approx(1.2360, abs=1e-12)
    # Deviations of 2, 0, 2 mm with two degrees of freedom.
    assert reading.spread == pytest.approx(0.002)


@pytest.mark.parametrize("code", sorted(ADVICE))
def test_every_error_code_of_a_rangefinder_has_its_advice(code):
    with scripted_station([DIMETIX[0], (b"s0g", b"g0@E%d\r\n" % code)]) as port:
        finder = rangefinder(port, shots=1)
        with pytest.raises(Refused, match=f"error {code}, ") as caught:
            finder.read()
        finder.close()
    assert ADVICE[code] in caught.value.reason
    assert caught.value.raw == b"g0@E%d" % code


@pytest.mark.parametrize("instead", [b"g0?\r\n", b"g1g+00099999\r\n", b"g0g+000123\r\n", b""])
def test_what_is_no_distance_is_followed_by_a_clear_and_a_new_one(instead):
    clear, measure, _ = DIMETIX
    late = (clear[0], b"g0g+00099999\r\n" + clear[1])
    with scripted_station([clear, (measure[0], instead), late, clear, measure]) as port:
        finder = rangefinder(port, shots=1)
        # The second clear is answered by a distance, so it is sent again.
        assert finder.read().value == pytest.approx(1.2345, abs=1e-12)
        finder.close()


def test_a_gauge_is_read_byte_for_byte():
    with scripted_station([*MAGNESCALE, *MAGNESCALE]) as port:
        gauge = MagnescaleGauge(port, "slide", reply_timeout_s=0.2)
        gauge.connect()
        assert gauge.read().value == pytest.approx(0.123456, abs=1e-12)
        gauge.close()


@pytest.mark.parametrize(
    ("reply", "length"),
    [(b"RNM -012.345\r\n", -0.012345), (b"RNI +1.00000\r\n", 0.0254), (b"RNM +0.00100\r\n", 1e-6)],
)
def test_sign_and_unit_of_a_gauge_are_kept(reply, length):
    with scripted_station([(b"R", reply), (b"R", reply)]) as port:
        gauge = MagnescaleGauge(port, "slide", reply_timeout_s=0.2)
        gauge.connect()
        assert gauge.read().value == pytest.approx(length, abs=1e-12)
        gauge.close()


@pytest.mark.parametrize("reply", [b"RNM 0123.456\r\n", b"RNX +123.456\r\n", b"RNM +12.34\r\n"])
def test_a_line_of_another_form_is_no_length(reply):
    with scripted_station([(b"R", reply)] * 3) as port:
        gauge = MagnescaleGauge(port, "slide", reply_timeout_s=0.1)
        with pytest.raises(BadReply, match="garbled") as caught:
            gauge.connect()
        assert caught.value.raw == reply.strip()
        gauge.close()


def test_an_encoder_is_read_byte_for_byte():
    with scripted_unit(LIKA) as port:
        encoder = LikaEncoder(port, "rod_angle", reply_timeout_s=0.3)
        encoder.connect()
        assert encoder.read().value == pytest.approx(12272 / 4096 * 2 * math.pi, abs=1e-12)
        encoder.close()


PROFILE = """
kind: temperature
baud: 9600
frame: 8N1
table: holding
address: 7
type: uint16
scale_degc: 0.1
lowest_degc: 0
highest_degc: 100
broken: []
"""


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ("table: coil", "field table is 'coil'"),
        ("address: seven", "field address is 'seven'"),
        ("address: 70000", "not within 0 to 65535"),
        ("scale_degc: true", "not a number"),
        ("colour: red", "field colour is not known"),
        ("broken: none", "not a list"),
        ("kind: robot", "not one of temperature"),
        ("frame: [8]", "not text"),
    ],
)
def test_a_wrong_field_of_a_profile_is_named(tmp_path, line, problem):
    name = line.partition(":")[0]
    kept = [old for old in PROFILE.splitlines() if not old.startswith(name + ":")]
    path = tmp_path / "mine.yaml"
    path.write_text("\n".join([*kept, line]))
    with pytest.raises(Refused, match=problem) as caught:
        ModbusTemperature(f"/dev/null?profile={path}")
    assert "mine.yaml" in caught.value.reason


@pytest.mark.parametrize(
    ("text", "problem"),
    [("just words", "has no fields"), ("a: [", "is not YAML"), (None, "there is")],
)
def test_a_file_that_is_no_profile_is_refused(tmp_path, text, problem):
    path = tmp_path / "mine.yaml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(Refused, match=problem):
        ModbusTemperature(f"/dev/null?profile={path}")


@pytest.mark.parametrize("options", ["baud=fast", "frame=9X3", "baud", "id=1&id=2"])
def test_a_wrong_option_is_said_before_anything_is_opened(options):
    with pytest.raises(Unreachable):
        LikaEncoder(f"/dev/null?{options}", "rod_angle").connect()

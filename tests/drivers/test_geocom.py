"""The GeoCOM driver on its own against fixed conversations on a real pseudo-terminal."""

import math
import re
from pathlib import Path

import pytest
from geocompy.geo.gctypes import GeoComCode
from scripted_station import PAUSE, exchanges, scripted_station

from drivers.devices.geocom import Atmosphere, GeoComTracker
from drivers.devices.geocom.codes import ADVICE_BY_GROUP, advice_on
from drivers.errors import BadReply, NoReply, Refused, Unreachable

TRANSCRIPTS = Path(__file__).parent / "transcripts"
SESSION = [(sent, reply + b"\r\n") for sent, reply in exchanges(TRANSCRIPTS / "geocom_session.txt")]
START, AIM, SHOT, AIR = SESSION[:7], SESSION[7], SESSION[8], SESSION[9:]


@pytest.fixture(autouse=True)
def _no_second_of_waiting(monkeypatch):
    """`geocompy` sleeps a fixed second after its first exchange."""
    monkeypatch.setattr("geocompy.geo.sleep", lambda _: None)


def crc(text: bytes) -> int:
    """CRC-16/ARC by long division of polynomials, most significant bit first on mirrored bits."""
    bits = [byte >> i & 1 for byte in text for i in range(8)] + [0] * 16
    for start in range(len(bits) - 16):
        if bits[start]:
            # x^16 + x^15 + x^2 + 1
            for power in (0, 1, 14, 16):
                bits[start + power] ^= 1
    return sum(bit << i for i, bit in enumerate(bits[-16:]))


def checked(line: bytes) -> bytes:
    """Put the checksum into a line that has none, and end it."""
    head, colon, tail = line.partition(b":")
    return head + b",%d" % crc(line) + colon + tail + b"\r\n"


def shot_reply(transaction: int, code: int, values: bytes = b"") -> bytes:
    return checked(b"%%R1P,0,%d:%d" % (transaction, code) + values)


def tracker(port: str, **options) -> GeoComTracker:
    made = GeoComTracker(port, reply_timeout_s=0.3, measure_timeout_s=0.3, **options)
    made.connect()
    return made


def test_the_checksums_of_the_transcript_are_crc_16_arc():
    assert crc(b"123456789") == 0xBB3D  # The check value of the CRC catalogues.
    for line in [line for exchange in SESSION for line in exchange]:
        head, checksum, tail = re.fullmatch(rb"(.*?),(\d+)(:.*?)(?:\r\n)?", line).groups()
        assert crc(head + tail) == int(checksum)


def test_a_session_is_held_byte_for_byte_and_read_right():
    with scripted_station(SESSION) as port:
        station = tracker(port, shots=1)
        reading = station.measure()
        assert station.atmosphere() == Atmosphere(1013.25, 20.0, 15.0)
        station.set_atmospheric_ppm(4.25)
        assert station.atmospheric_ppm() == 4.25
        station.close()
    # The distance comes with nine decimals.
    assert reading.position == pytest.approx((1.234567, 2.345678, 0.456789), abs=1e-9)
    assert reading.orientation is None
    assert (reading.shots, reading.spread) == (1, 0.0)


@pytest.mark.parametrize(
    ("horizontal", "vertical", "expected"),
    [
        (0.0, math.pi / 2, (0, 2, 0)),  # North.
        (math.pi / 2, math.pi / 2, (2, 0, 0)),  # East: clockwise from north.
        (0.0, 0.0, (0, 0, 2)),  # Zenith.
        (3 * math.pi / 2, 3 * math.pi / 4, (-math.sqrt(2), 0, -math.sqrt(2))),  # West and down.
    ],
)
def test_angles_count_clockwise_from_north_and_from_the_zenith(horizontal, vertical, expected):
    values = b",%.15f,%.15f,2.0,2" % (horizontal, vertical)
    with scripted_station([*START, AIM, (SHOT[0], shot_reply(8, 0, values))]) as port:
        station = tracker(port, shots=1)
        assert station.measure().position == pytest.approx(expected, abs=1e-12)
        station.close()


def test_several_shots_are_averaged_with_their_spread():
    distances = (b"1.000", b"1.002", b"1.004")
    shots = [
        (
            checked(b"%%R1Q,17017,%d:2" % number).strip(),
            shot_reply(number, 0, b",0.0,1.570796326794897," + distance + b",2"),
        )
        for number, distance in enumerate(distances, start=8)
    ]
    with scripted_station([*START, AIM, *shots]) as port:
        station = tracker(port, shots=3)
        reading = station.measure()
        station.close()
    assert reading.position == pytest.approx((0, 1.002, 0), abs=1e-12)
    assert reading.shots == 3
    # Deviations of 2, 0, 2 mm with two degrees of freedom.
    assert reading.spread == pytest.approx(0.002)


@pytest.mark.parametrize(
    ("code", "advice"),
    [
        (1283, "compensator"),
        (1284, "accuracy is not guaranteed"),
        (1285, "no distance"),
        (1288, "level the station"),
        (1290, "no valid angle"),
        (1291, "ppm"),
        (1292, "distance mode"),
        (1293, "another program"),
        (1294, "no signal"),
        (2, "parameter"),
        (8, "aborted"),
        (12, "shuts down"),
        (8704, "in time"),
        (8705, "blocked"),
        (8710, "line of sight"),
        (8711, "several targets"),
        (8712, "shade"),
        (31234, "manual"),
    ],
)
def test_a_code_other_than_0_is_refused_with_advice_even_with_values(code, advice):
    values = SHOT[1].strip().partition(b":0")[2]
    with scripted_station([*START, AIM, (SHOT[0], shot_reply(8, code, values))]) as port:
        station = tracker(port, shots=1)
        with pytest.raises(Refused, match=advice) as caught:
            station.measure()
        station.close()
    assert caught.value.command == "BAP_MeasDistanceAngle"
    assert str(code) in caught.value.reason
    assert b":%d," % code in caught.value.raw


def test_every_documented_code_has_advice_and_no_group_of_codes_is_made_up():
    codes = [code for code in GeoComCode if code not in {GeoComCode.OK, GeoComCode.UNDEFINED}]
    assert len(codes) > 400
    for code in codes:
        assert "look it up" not in advice_on(code), code
    for group in ADVICE_BY_GROUP:
        assert any(code.name.startswith(group) for code in codes), group
    assert "look it up" in advice_on(GeoComCode.UNDEFINED)


def air_exchanges(entered: bytes, kept: bytes) -> list[tuple[bytes, bytes]]:
    """Read the air, enter another, read it again; the wavelength stays what it was."""
    now = b"0.000000658,1013.25,20.0,15.0"
    lines = [
        (b"%R1Q,2029,7:", b"%R1P,0,7:0," + now),
        (b"%R1Q,2028,8:0.000000658," + entered, b"%R1P,0,8:0"),
        (b"%R1Q,2029,9:", b"%R1P,0,9:0,0.000000658," + kept),
    ]
    return [(checked(request).strip(), checked(reply)) for request, reply in lines]


def test_the_air_is_entered_with_the_wavelength_as_it_was():
    air = b"990.5,22.25,12.0"
    with scripted_station([*START, *air_exchanges(air, air)]) as port:
        station = tracker(port)
        station.set_atmosphere(Atmosphere(990.5, 22.25, 12.0))
        station.close()


def test_a_station_that_does_not_keep_the_air_is_told():
    exchanged = air_exchanges(b"990.5,22.25,12.0", b"1013.25,22.25,12.0")
    with scripted_station([*START, *exchanged]) as port:
        station = tracker(port)
        with pytest.raises(Refused, match="enter the air at the station"):
            station.set_atmosphere(Atmosphere(990.5, 22.25, 12.0))
        station.close()


@pytest.mark.parametrize(
    "broken",
    [
        b"",
        SHOT[1][:20],
        SHOT[1].replace(b"29047", b"29046"),
        SHOT[1].replace(b"1.400", b"1.500"),
        b"\xff\x00noise\r\n",
        checked(b"%R1P,3101,0:0"),
        checked(b"%R1P,0,7:0,0.5,1.5,9.9,2") + SHOT[1][:30],
    ],
)
def test_a_missing_or_garbled_shot_is_taken_again(broken):
    again = (
        checked(b"%R1Q,17017,9:2").strip(),
        shot_reply(9, 0, SHOT[1].strip().partition(b":0")[2]),
    )
    with scripted_station([*START, AIM, (SHOT[0], broken), again]) as port:
        station = tracker(port, shots=1)
        reading = station.measure()
        station.close()
    assert reading.position == pytest.approx((1.234567, 2.345678, 0.456789), abs=1e-9)


def test_the_late_end_of_a_reply_does_not_spoil_the_next_one():
    # The driver waits 0.3 s; the rest comes after that, but before the line has been quiet.
    torn = SHOT[1][:30] + PAUSE + SHOT[1][30:]
    again = (
        checked(b"%R1Q,17017,9:2").strip(),
        shot_reply(9, 0, SHOT[1].strip().partition(b":0")[2]),
    )
    with scripted_station([*START, AIM, (SHOT[0], torn), again]) as port:
        station = tracker(port, shots=1)
        assert station.measure().position == pytest.approx((1.234567, 2.345678, 0.456789), abs=1e-9)
        station.close()


def test_a_late_reply_to_an_earlier_request_is_passed_over():
    late = shot_reply(3, 0, b",0.1,0.2,9.9,2") + shot_reply(7, 0)
    with scripted_station([*START, AIM, (SHOT[0], late + SHOT[1])]) as port:
        station = tracker(port, shots=1)
        reading = station.measure()
        station.close()
    assert reading.position == pytest.approx((1.234567, 2.345678, 0.456789), abs=1e-9)


@pytest.mark.parametrize(
    ("reply", "error"),
    [(lambda _: b"", NoReply), (lambda n: shot_reply(n, 0), BadReply)],
)
def test_three_failures_are_told(reply, error):
    shots = [(checked(b"%%R1Q,17017,%d:2" % n).strip(), reply(n)) for n in (8, 9, 10)]
    with scripted_station([*START, AIM, *shots]) as port:
        station = tracker(port, shots=1)
        with pytest.raises(error, match="BAP_MeasDistanceAngle"):
            station.measure()
        station.close()


def test_a_station_that_sends_few_decimals_is_told_to_send_more():
    few = (START[1][0], checked(b"%R1P,0,1:0,4"))
    told = [
        (checked(b"%R1Q,107,6:15").strip(), checked(b"%R1P,0,6:0")),
        (checked(b"%R1Q,18005,7:1").strip(), checked(b"%R1P,0,7:0")),
    ]
    with scripted_station([START[0], few, *START[2:6], *told]) as port:
        tracker(port).close()


def test_a_silent_port_does_not_speak_geocom():
    silent = [(checked(b"%%R1Q,0,%d:" % number).strip(), b"") for number in (0, 1)]
    with (
        scripted_station(silent) as port,
        pytest.raises(NoReply, match="nothing there speaks GeoCOM"),
    ):
        tracker(port)


def test_a_port_that_does_not_exist_is_unreachable(tmp_path):
    with pytest.raises(Unreachable, match="does not open"):
        GeoComTracker(str(tmp_path / "ttyUSB7")).connect()


def test_a_tracker_that_was_not_connected_says_so():
    station = GeoComTracker("/dev/null")
    with pytest.raises(Unreachable, match="call connect"):
        station.measure()
    station.close()


def test_less_than_one_shot_makes_no_reading():
    with pytest.raises(ValueError, match="shots"):
        GeoComTracker("/dev/null", shots=0)

"""The relay driver on its own: what lines mean, axes, checksums, wrong profiles."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from scripted_station import scripted_station

from drivers.devices.relay import RelayTracker
from drivers.devices.relay.axes import Axes
from drivers.devices.relay.line_profile import LineError, LineProfile
from drivers.errors import BadReply, Refused

PROFILES = Path(__file__).parents[2] / "drivers" / "profiles"
LINE = b"$LT,1,1234.5670,2345.6780,456.7890,1.000000000,0.000000000,0.000000000,0.000000000*3E\r\n"


def rotation(w: float, x: float, y: float, z: float) -> np.ndarray:
    """Rotation matrix of a unit quaternion, from its action on the axes by Rodrigues' formula."""
    v = np.array([x, y, z])
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return (w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * cross


def profile(tmp_path: Path, name: str, *changes: tuple[str, str]) -> Path:
    text = (PROFILES / f"{name}.yaml").read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    return path


def signed_axes():
    for order in itertools.permutations("xyz"):
        for signs in itertools.product(("", "-"), repeat=3):
            yield tuple(sign + name for sign, name in zip(signs, order, strict=True))


@pytest.mark.parametrize("names", [*signed_axes()], ids="".join)
def test_every_set_of_axes_turns_points_and_orientations_alike(names):
    axes = Axes(names)
    P = np.array([axes.point(column) for column in np.eye(3)]).T
    for row, name in zip(P, names, strict=True):
        expected = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}[name.lstrip("-")]
        assert tuple(row) == tuple(np.array(expected) * (-1 if name[0] == "-" else 1))
    assert axes.mirrors == (np.linalg.det(P) < 0)
    if not axes.mirrors:
        turn = np.array([0.4, -0.1, 0.7, 0.2]) / np.linalg.norm([0.4, -0.1, 0.7, 0.2])
        ours = rotation(*axes.orientation(tuple(turn)))
        np.testing.assert_allclose(ours, P @ rotation(*turn), atol=1e-12)


def test_a_triggered_line_is_read_right():
    with scripted_station([(b"M 1", LINE), (b"M 2", LINE.replace(b"T,1", b"T,2"))]) as port:
        tracker = RelayTracker(port, shots=1, reply_timeout_s=0.2, first_number=1)
        tracker.connect()
        with pytest.raises(BadReply, match="checksum is 3E and its bytes make 3D") as caught:
            tracker._one_reading()
        tracker.close()
    assert caught.value.raw.startswith(b"$LT,2")


def test_a_late_line_of_an_earlier_trigger_is_passed_over():
    late = LINE.replace(b"1234", b"9999").replace(b"*3E", b"*3A")
    assert _xor(late) == 0x3A
    second = LINE.replace(b"T,1", b"T,2").replace(b"*3E", b"*3D")
    with scripted_station([(b"M 1", LINE), (b"M 2", late + second)]) as port:
        tracker = RelayTracker(port, shots=1, reply_timeout_s=0.3, first_number=1)
        tracker.connect()
        reading = tracker.measure()
        tracker.close()
    assert reading.position == pytest.approx((1.234567, 2.345678, 0.456789), abs=1e-12)
    assert reading.orientation == (1.0, 0.0, 0.0, 0.0)


def _xor(line: bytes) -> int:
    check = 0
    for byte in line[1 : line.index(b"*")]:
        check ^= byte
    return check


@pytest.mark.parametrize(
    ("kind", "check"),
    # 31..39 hex: their exclusive or, their sum modulo 256, and the check value of the catalogues.
    [("xor8", "31"), ("sum8", "DD"), ("crc16_arc", "BB3D")],
)
def test_each_kind_of_checksum_is_compared(tmp_path, kind, check):
    path = profile(
        tmp_path,
        "relay_triggered_6d",
        ("checksum: xor8", f"checksum: {kind}"),
        ("[0-9A-F]{2})'\nerror", "[0-9A-F]{2,4})'\nerror"),
    )
    text = path.read_text()
    start = text.index("line: '")
    end = text.index("\n", start)
    pattern = r"(?P<body>(?P<number>\d)(?P<x>\d)(?P<y>\d)(?P<z>\d)\d+)\*(?P<checksum>[0-9A-F]+)"
    path.write_text(text[:start] + f"line: '{pattern}'" + text[end:])
    lines = LineProfile.read("device", str(path))
    assert lines.understand(f"123456789*{check}".encode()).position == (0.002, 0.003, 0.004)
    with pytest.raises(LineError, match="checksum"):
        lines.understand(f"123456780*{check}".encode())


@pytest.mark.parametrize(
    ("name", "old", "new", "problem"),
    [
        ("relay_streamed_3d", r"(?P<number>\d{8}) (?P<x>", r"\d{8} (?P<x>", "an old line is not"),
        ("relay_triggered_6d", r"LT,(?P<number>\d+)", r"LT,\d+", "an old line is not told"),
        ("relay_triggered_6d", "(?P<qz>", "(?P<qq>", "all of qw"),
        ("relay_triggered_6d", "(?P<x>", "(?P<x", "no regular expression"),
        ("relay_triggered_6d", "(?P<body>L", "(?:L", "needs the groups body and checksum"),
        ("relay_triggered_6d", "axes: [x, y, z]", "axes: [x, y, -z]", "left-handed"),
        ("relay_triggered_6d", "axes: [x, y, z]", "axes: [x, x, z]", "axes must be x, y and z"),
        ("relay_triggered_6d", "axes: [x, y, z]", "axes: 3", "not a list of words"),
        ("relay_triggered_6d", "(?P<code>", "(?P<kode>", "must have the group code"),
        ("relay_triggered_6d", "position_unit: mm", "position_unit: inch", "not one of m, mm"),
        ("relay_triggered_6d", "  TILT: the", "  7: the", "does not map words"),
    ],
)
def test_a_wrong_profile_is_refused_by_file_and_field(tmp_path, name, old, new, problem):
    path = profile(tmp_path, name, (old, new))
    with pytest.raises(Refused, match=problem) as caught:
        RelayTracker(f"/dev/null?profile={path}")
    assert "mine.yaml" in caught.value.reason


def test_a_left_handed_frame_is_fine_for_positions(tmp_path):
    path = profile(tmp_path, "relay_streamed_3d", ("[y, x, -z]", "[x, y, -z]"))
    lines = LineProfile.read("device", str(path))
    measured = lines.understand(b"P 00000001 +001.0000000 +002.0000000 -003.0000000")
    assert measured.position == (1.0, 2.0, 3.0)


def test_less_than_one_shot_makes_no_reading():
    with pytest.raises(ValueError, match="shots"):
        RelayTracker("/dev/null", shots=0)

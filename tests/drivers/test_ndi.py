"""The NDI driver on its own, through the real client library, against a fixed conversation."""

import struct
from pathlib import Path

import pytest
from scripted_station import scripted_unit

from drivers.devices.ndi import NdiTracker
from drivers.devices.ndi.codes import ADVICE
from drivers.errors import Refused, Unreachable

TRANSCRIPT = Path(__file__).parent / "transcripts" / "ndi.txt"


def crc(text: bytes) -> int:
    """CRC-16/ARC by long division of polynomials, on mirrored bits."""
    bits = [byte >> i & 1 for byte in text for i in range(8)] + [0] * 16
    for start in range(len(bits) - 16):
        if bits[start]:
            for power in (0, 1, 14, 16):
                bits[start + power] ^= 1
    return sum(bit << i for i, bit in enumerate(bits[-16:]))


def conversation() -> list[tuple[bytes, bytes]]:
    lines = [line for line in TRANSCRIPT.read_text().splitlines() if line[0] != "#"]
    sent = [
        bytes.fromhex(line[3:]) if line.startswith("<x") else line[2:].encode() + b"\r"
        for line in lines
    ]
    return list(zip(sent[::2], sent[1::2], strict=True))


START, SHOTS = conversation()[:-2], conversation()[-2:]


def error_reply(code: int) -> bytes:
    text = b"ERROR%02X" % code
    return text + b"%04X\r" % crc(text)


def test_the_checksums_of_the_transcript_are_crc_16_arc():
    assert crc(b"123456789") == 0xBB3D  # The check value of the CRC catalogues.
    for frame in [frame for exchange in conversation() for frame in exchange]:
        if frame[:2] == b"\xc4\xa5":
            (length,) = struct.unpack("<H", frame[2:4])
            assert len(frame) == length + 8
            assert frame[4:6] == struct.pack("<H", crc(frame[:4]))
            assert frame[-2:] == struct.pack("<H", crc(frame[6:-2]))
        else:
            assert frame[-5:] == b"%04X\r" % crc(frame[:-5])


def test_a_session_is_held_byte_for_byte_and_read_right():
    with scripted_unit([*START, *SHOTS]) as port:
        camera = NdiTracker(port, shots=2)
        camera.connect()
        reading = camera.measure()
        camera.close()
    assert reading.position == pytest.approx((0.0125, -0.05675, -1.2345), abs=1e-12)
    assert reading.orientation == pytest.approx((0.5, -0.5, 0.5, -0.5), abs=1e-12)
    assert (reading.shots, reading.spread) == (2, 0.0)


@pytest.mark.parametrize("code", [0x08, 0x0F, 0x1A, 0x3A])
def test_an_error_code_is_refused_with_advice(code):
    # The library does not understand an error in reply to BX; the text command shows it.
    as_text = (b"TX:0001031A\r", error_reply(code))
    with scripted_unit([*START, (SHOTS[0][0], error_reply(code)), as_text]) as port:
        camera = NdiTracker(port, shots=1)
        camera.connect()
        with pytest.raises(Refused, match=f"error {code:02X}") as caught:
            camera.measure()
        camera.close()
    assert ADVICE.get(code, "API guide") in caught.value.reason


def test_a_tracker_that_was_not_connected_says_so():
    camera = NdiTracker("/dev/null")
    with pytest.raises(Unreachable, match="call connect"):
        camera.measure()
    camera.close()


def test_a_port_that_does_not_exist_is_unreachable(tmp_path):
    camera = NdiTracker(str(tmp_path / "ttyUSB7"))
    with pytest.raises(Unreachable, match="does not open"):
        camera.connect()
    assert camera.child_pid is None


def test_less_than_one_shot_makes_no_reading():
    with pytest.raises(ValueError, match="shots"):
        NdiTracker("/dev/null", shots=0)

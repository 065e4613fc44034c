"""Stage sensors and temperature probe: emulators against the manuals' bytes, drivers likewise."""

import math
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from instrument_cell import TRANSCRIPTS, exchange_bytes, instrument_cell

from drivers.devices.dimetix import DimetixRangefinder
from drivers.devices.lika import LikaEncoder
from drivers.devices.magnescale import MagnescaleGauge
from drivers.devices.modbus_temperature import ModbusTemperature
from drivers.errors import BadReply, DriverError, NoReply, Refused, Unreachable
from drivers.registry import open_stage_sensor, open_temperature_probe


@dataclass(frozen=True)
class Instrument:
    """One instrument, how it is started, driven and read."""

    name: str
    emulator: tuple[str, ...]
    open: Callable[[str], Any]
    """From the address to a driver with a short patience."""
    read: Callable[[Any], float]
    values: tuple[float, float]
    """Two values that the wire can say exactly."""
    setting: Callable[[float], tuple[str, Any]]
    """What to set in the world."""
    baud: int
    code: int
    """An error code that it may answer with."""
    advice: str
    """A word of the advice that comes with it."""
    checked: bool
    """Whether its protocol has a checksum."""
    numbered: bool
    """Whether its replies carry its id."""


def stage(sensor: str) -> Callable[[float], tuple[str, Any]]:
    return lambda value: ("stage", {sensor: value})


def open_dimetix(address: str) -> DimetixRangefinder:
    """A pseudo-terminal knows no 7E1, which is how the sensor is set in the factory."""
    joint = "&" if "?" in address else "?"
    return DimetixRangefinder(f"{address}{joint}frame=8N1", "s", shots=1, reply_timeout_s=0.15)


STEP = 2 * math.pi / 4096
INSTRUMENTS = [
    Instrument(
        "dimetix",
        ("dimetix_rangefinder", "--sensor", "s"),
        open_dimetix,
        lambda driver: driver.read().value,
        (1.2345, -0.0007),
        stage("s"),
        19200,
        255,
        "too weak",
        checked=False,
        numbered=True,
    ),
    Instrument(
        "magnescale",
        ("magnescale_gauge", "--sensor", "s"),
        lambda address: MagnescaleGauge(address, "s", reply_timeout_s=0.15),
        lambda driver: driver.read().value,
        (0.123456, -0.000007),
        stage("s"),
        9600,
        0,
        "marks its reading E",
        checked=False,
        numbered=False,
    ),
    Instrument(
        "lika",
        ("lika_encoder", "--sensor", "s"),
        lambda address: LikaEncoder(address, "s", reply_timeout_s=0.15),
        lambda driver: driver.read().value,
        (12272 * STEP, -3 * STEP),
        stage("s"),
        9600,
        4,
        "device failure",
        checked=True,
        numbered=True,
    ),
    Instrument(
        "modbus_temperature",
        ("temperature_transmitter",),
        lambda address: ModbusTemperature(address, reply_timeout_s=0.15),
        lambda driver: driver.read().temperature_degc,
        (21.37, -4.25),
        lambda value: ("temperature_degc", value),
        9600,
        6,
        "busy",
        checked=True,
        numbered=True,
    ),
]


class Running:
    """A running instrument with its driver."""

    def __init__(self, cell, instrument: Instrument) -> None:
        self.cell = cell
        self.instrument = instrument
        self.driver = instrument.open(cell.station.port)

    def put(self, value: float) -> None:
        self.cell.set(*self.instrument.setting(value))

    def fault(self, kind: str, **order: Any) -> None:
        assert self.cell.station.order(fault=kind, **order)["ok"]

    def read(self) -> float:
        return self.instrument.read(self.driver)

    def must_read(self, value: float) -> None:
        assert self.read() == pytest.approx(value, abs=1e-9)


@contextmanager
def running_instrument(folder: Path, instrument: Instrument) -> Iterator[Running]:
    with instrument_cell(folder, *instrument.emulator, stage={"s": 0.0}) as cell:
        yield Running(cell, instrument)


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    """Every instrument once, started when it is first needed."""
    kept: dict[str, Running] = {}
    with ExitStack() as stack:

        def start(instrument: Instrument) -> Running:
            if instrument.name not in kept:
                folder = tmp_path_factory.mktemp(instrument.name)
                kept[instrument.name] = stack.enter_context(running_instrument(folder, instrument))
            return kept[instrument.name]

        yield start


@pytest.fixture(params=INSTRUMENTS, ids=lambda instrument: instrument.name)
def started(request, running):
    return running(request.param)


@pytest.fixture
def one(started):
    started.fault("plugged")
    started.fault("none")
    started.put(started.instrument.values[0])
    started.driver.connect()
    yield started
    started.driver.close()


SPOILT_BYTES = ["silence", "cut_reply", "noise", "late_reply"]


def test_a_reading_is_the_worlds(one):
    first, second = one.instrument.values
    one.must_read(first)
    one.put(second)
    one.must_read(second)


def spoilable() -> Iterator[Any]:
    """Every instrument with every fault that its wire can have."""
    for instrument in INSTRUMENTS:
        checked = ["wrong_checksum"] if instrument.checked else []
        numbered = ["wrong_id"] if instrument.numbered else []
        for kind in (*SPOILT_BYTES, *checked, *numbered):
            yield pytest.param(instrument, kind, id=f"{instrument.name}-{kind}")


@pytest.mark.parametrize(("started", "kind"), [*spoilable()], indirect=["started"])
def test_a_fault_of_the_line_is_overcome(one, kind):
    first, second = one.instrument.values
    one.fault(kind, delay_s=0.4 if kind == "late_reply" else 0.0)
    one.must_read(first)
    one.put(second)
    one.must_read(second)


@pytest.mark.parametrize(("kind", "error"), [("silence", NoReply), ("cut_reply", BadReply)])
def test_a_fault_that_lasts_is_told_and_forgotten_when_it_is_over(one, kind, error):
    one.fault(kind, replies=100)
    with pytest.raises(error) as caught:
        one.read()
    assert one.instrument.name in caught.value.device
    assert caught.value.command
    assert "check" in caught.value.reason
    assert bool(caught.value.raw) == (error is BadReply)
    one.fault("none")
    one.put(one.instrument.values[1])
    one.must_read(one.instrument.values[1])


def test_a_late_reply_is_never_the_next_reading(one):
    first, second = one.instrument.values
    one.fault("late_reply", delay_s=0.4, replies=3)
    with pytest.raises(DriverError):
        one.read()
    one.put(second)
    one.must_read(second)
    one.put(first)
    one.must_read(first)


def test_an_error_code_is_refused_with_advice_and_not_asked_again(one):
    one.fault("code", code=one.instrument.code)
    with pytest.raises(Refused, match=one.instrument.advice) as caught:
        one.read()
    assert caught.value.raw
    one.must_read(one.instrument.values[0])


def test_unplugged_is_unreachable_and_works_again_when_it_is_back(one):
    one.fault("unplugged")
    for _ in range(2):
        with pytest.raises(Unreachable, match="cable"):
            one.read()
    one.fault("plugged")
    one.must_read(one.instrument.values[0])


def test_a_wrong_speed_is_told_with_the_speed(one):
    one.driver.close()
    other = one.instrument.open(f"{one.cell.station.port}?baud=57600")
    with pytest.raises(BadReply, match="57600 baud"):
        other.connect()
    other.close()


def test_a_port_in_use_is_unreachable(one):
    second = one.instrument.open(one.cell.station.port)
    with pytest.raises(Unreachable, match="no other program"):
        second.connect()
    second.close()


def test_a_driver_that_was_not_connected_says_so(started):
    with pytest.raises(Unreachable, match="call connect"):
        started.instrument.read(started.instrument.open(started.cell.station.port))


def test_an_option_that_is_not_known_is_named(started):
    with pytest.raises(Unreachable, match=r"'colour=red'.*baud="):
        started.instrument.open("/dev/null?colour=red")


def modbus_crc(frame: bytes) -> bytes:
    """CRC-16/MODBUS by long division of polynomials, on mirrored bits."""
    bits = [byte >> i & 1 for byte in frame for i in range(8)] + [0] * 16
    bits[:16] = [bit ^ 1 for bit in bits[:16]]  # The register starts full of ones.
    for start in range(len(bits) - 16):
        if bits[start]:
            for power in (0, 1, 14, 16):
                bits[start + power] ^= 1
    return sum(bit << i for i, bit in enumerate(bits[-16:])).to_bytes(2, "little")


def test_the_checksums_of_the_transcript_are_those_of_modbus():
    assert modbus_crc(b"123456789") == (0x4B37).to_bytes(2, "little")  # Of the CRC catalogues.
    for frame in [frame for exchange in binary_exchanges("lika.txt") for frame in exchange]:
        assert modbus_crc(frame[:-2]) == frame[-2:]


def ascii_exchanges(name: str) -> Iterator[tuple[bytes, bytes]]:
    lines = (TRANSCRIPTS / name).read_bytes().splitlines()
    lines = [line[2:] + b"\r\n" for line in lines if line[:1] in b"<>" and line]
    yield from zip(lines[::2], lines[1::2], strict=True)


def binary_exchanges(name: str) -> Iterator[tuple[bytes, bytes]]:
    lines = (TRANSCRIPTS / name).read_text().splitlines()
    frames = [bytes.fromhex(line[2:]) for line in lines if line[0] in "<>"]
    yield from zip(frames[::2], frames[1::2], strict=True)


@pytest.mark.parametrize(
    ("instrument", "value", "exchanges"),
    [
        (INSTRUMENTS[0], 1.2345, [*ascii_exchanges("dimetix.txt")]),
        (INSTRUMENTS[1], 0.123456, [*ascii_exchanges("magnescale.txt")]),
        (INSTRUMENTS[2], 12272 * STEP, [*binary_exchanges("lika.txt")]),
    ],
    ids=["dimetix", "magnescale", "lika"],
)
def test_the_emulator_answers_byte_for_byte(tmp_path, instrument, value, exchanges):
    with running_instrument(tmp_path, instrument) as running:
        running.put(value)
        for request, reply in exchanges:
            port = running.cell.station.port
            assert exchange_bytes(port, instrument.baud, request, len(reply)) == reply


def test_a_gauge_set_to_inches_reads_metres(tmp_path):
    with instrument_cell(
        tmp_path, "magnescale_gauge", "--sensor", "s", "--unit", "inch", stage={"s": 0.0127}
    ) as cell:
        gauge = open_stage_sensor("magnescale", cell.station.port, "s")
        gauge.connect()
        assert gauge.read().value == pytest.approx(0.0127, abs=1e-9)
        gauge.close()


def test_an_encoder_alarm_is_refused(tmp_path):
    with running_instrument(tmp_path, INSTRUMENTS[2]) as running:
        running.driver.connect()
        running.fault("alarm", code=0x0102)
        with pytest.raises(Refused, match="0x0102"):
            running.read()
        running.driver.close()


def test_a_broken_temperature_sensor_is_refused(tmp_path):
    with running_instrument(tmp_path, INSTRUMENTS[3]) as running:
        probe = open_temperature_probe("modbus_temperature", running.cell.station.port)
        probe.connect()
        running.fault("sensor_broken")
        with pytest.raises(Refused, match="broken or missing sensor"):
            probe.read()
        running.put(160.0)
        with pytest.raises(BadReply, match="160 degC is outside -50 to 150"):
            probe.read()
        probe.close()


def test_an_emulator_says_what_faults_it_has(started):
    refused = started.cell.station.order(fault="fire")
    assert not refused["ok"]
    assert "late_reply" in refused["message"]


def test_an_instrument_ends_when_the_world_ends(tmp_path):
    with running_instrument(tmp_path, INSTRUMENTS[0]) as running:
        running.driver.connect()
        running.cell.world.end()
        with pytest.raises((NoReply, Unreachable)):
            running.read()
        assert running.cell.station.process.wait(5) == 1
        running.driver.close()

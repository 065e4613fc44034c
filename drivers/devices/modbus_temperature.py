"""Temperature probe over Modbus RTU, through `pymodbus`; the register's place in a profile.

Transmitters differ in table, address and scale only, so a profile (`drivers/profiles`, or one's own
file) says these, and which raw values stand for a broken sensor. A temperature outside the range
that the profile calls possible is no reading. Never tried on an instrument.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

from drivers.addresses import Address
from drivers.errors import BadReply, Refused
from drivers.interfaces import TemperatureReading
from drivers.modbus_link import Table, over_serial
from drivers.profile_file import read_profile
from drivers.transport import read_again

PROFILE = "pt100_transmitter"
UNIT = 1
REPLY_TIMEOUT_S = 0.5
SIGN = 1 << 15


@dataclass(frozen=True)
class TemperatureRegister:
    """Where a transmitter keeps the temperature, and how."""

    baud: int
    frame: str
    table: Table
    address: int
    signed: bool
    scale_degc: float
    """Degrees Celsius a count."""
    lowest_degc: float
    highest_degc: float
    broken: frozenset[int]
    """Raw values that stand for a broken sensor."""

    @classmethod
    def read(cls, device: str, name: str) -> TemperatureRegister:
        """Read a profile of the kind `temperature`."""
        profile = read_profile(device, name)
        profile.choice("kind", "temperature")
        register = cls(
            profile.whole("baud", 300, 4_000_000),
            profile.word("frame"),
            Table(profile.choice("table", *Table)),
            profile.whole("address", 0, 65535),
            profile.choice("type", "int16", "uint16") == "int16",
            profile.number("scale_degc"),
            profile.number("lowest_degc"),
            profile.number("highest_degc"),
            frozenset(profile.wholes("broken")),
        )
        profile.end()
        return register


class ModbusTemperature:
    """A probe at a serial port.

    Parameters
    ----------
    address
        Name of the serial port; options `profile` (pt100_transmitter), `id` (1), and `baud` and
        `frame` where they differ from the profile's.
    reply_timeout_s
        Longest wait for a reply [s].
    """

    def __init__(self, address: str, *, reply_timeout_s: float = REPLY_TIMEOUT_S) -> None:
        self._device = f"temperature probe modbus_temperature at {address}"
        where = Address(self._device, address, "profile", "id", "baud", "frame")
        self._register = TemperatureRegister.read(self._device, where.word("profile", PROFILE))
        self._link = over_serial(
            self._device,
            where.place,
            where.whole("baud", self._register.baud),
            where.word("frame", self._register.frame),
            where.whole("id", UNIT),
            reply_timeout_s,
        )

    def connect(self) -> None:
        """Open the port and see that a sound probe answers."""
        self._link.open()
        self.read()

    def read(self) -> TemperatureReading:
        """Read the temperature once; a missing or garbled reply is asked again.

        Raises
        ------
        Refused
            If the sensor is broken or the transmitter answers with an exception code.
        BadReply
            If the temperature is outside the profile's range: another register, or another scale.
        NoReply, Unreachable
            If the line fails.
        """
        place = self._register
        (raw,) = read_again(
            lambda: self._link.read("read temperature", place.table, place.address, 1)
        )
        if place.signed and raw & SIGN:
            raw -= 2 * SIGN
        if raw in place.broken:
            raise Refused(
                self._device,
                "read temperature",
                f"it reads {raw}, its mark for a broken or missing sensor; check the wires",
            )
        temperature = raw * place.scale_degc
        if not place.lowest_degc <= temperature <= place.highest_degc:
            raise BadReply(
                self._device,
                "read temperature",
                f"{temperature:g} degC is outside {place.lowest_degc:g} to {place.highest_degc:g}; "
                "check the profile's address and scale",
                raw.to_bytes(2, "big", signed=place.signed),
            )
        return TemperatureReading(temperature, time.monotonic())

    def close(self) -> None:
        """Close the port if open."""
        self._link.close()

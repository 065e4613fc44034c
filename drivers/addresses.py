"""Addresses with options: ``/dev/ttyUSB0?baud=9600&id=1``, ``10.0.0.5:502?profile=staubli_cs9``.

A cell's settings give a driver one line of text; what differs from a device's usual set-up stands
behind the question mark.
"""

from __future__ import annotations

from drivers.errors import Unreachable


class Address:
    """Where a device is, and what is not usual about it.

    Raises
    ------
    Unreachable
        If an option is unknown, given twice, or not of the form ``name=value``.
    """

    def __init__(self, device: str, text: str, *known: str) -> None:
        self.device = device
        self.place, _, tail = text.partition("?")
        self._options: dict[str, str] = {}
        for option in tail.split("&") if tail else ():
            name, equals, value = option.partition("=")
            if not equals or not value or name not in known or name in self._options:
                raise Unreachable(
                    device,
                    "configure",
                    f"address option {option!r} is not understood; after the question mark may "
                    f"stand, once each: {', '.join(f'{name}=...' for name in known)}",
                )
            self._options[name] = value

    def word(self, name: str, default: str) -> str:
        """Return an option as text."""
        return self._options.get(name, default)

    def whole(self, name: str, default: int) -> int:
        """Return an option that must be a whole number.

        Raises
        ------
        Unreachable
            If it is none.
        """
        value = self._options.get(name)
        if value is None:
            return default
        if not value.isdecimal():
            raise Unreachable(
                self.device, "configure", f"address option {name}={value} is not a whole number"
            )
        return int(value)

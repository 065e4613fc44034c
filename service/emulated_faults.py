"""Faults of emulated instruments under one vocabulary, whatever each emulator calls them.

A person writes ``tracker silence``, ``geocom late_reply delay_s=0.6 replies=2`` or ``probe none``.
A fault lasts until ``none`` unless `replies` says how many replies it spoils.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from robocal.errors import BadInput
from service.child_process import ChildProcess

Order = Mapping[str, object]
LASTING = 1_000_000
"""Replies: more than anybody waits for."""
PLACE = {"code": int, "delay_s": float, "replies": int}
"""What may stand behind a fault."""
_LATE_S = 4.0
"""Later than any driver waits for a reply [s]"""
_LINE = ("silence", "late_reply", "cut_reply", "noise", "frozen")
_CABLE = ("unplugged", "plugged", "wrong_baud", "none")


def _called_alike(*faults: str) -> dict[str, Order]:
    return {fault: {"fault": fault} for fault in faults}


_RTU = _called_alike(*_LINE, "wrong_checksum", "wrong_id", "code", *_CABLE)
FAULTS: Mapping[str, Mapping[str, Order]] = {
    "ur_rtde": {
        "silence": {"fault": "silent", "on": True},
        "reset": {"fault": "dropped"},
        "refused": {"fault": "refused", "on": True},
        "frozen": {"fault": "frozen", "on": True},
        "local_control": {"fault": "local_control", "on": True},
        "none": {"fault": "none"},
    },
    "modbus": _called_alike(
        *_LINE, "wrong_id", "code", "reset", "closed", "half_open", "refused", "none"
    ),
    "geocom": _called_alike(*_LINE, "wrong_checksum", "wrong_id", "code", *_CABLE),
    "ndi": _called_alike(
        *_LINE, "wrong_checksum", "wrong_id", "code", "missing", "disabled", *_CABLE
    ),
    "relay": _called_alike(*_LINE, "wrong_checksum", "wrong_id", "code", *_CABLE),
    "modbus_temperature": {**_RTU, **_called_alike("sensor_broken")},
    "dimetix": _called_alike(*_LINE, "wrong_id", "code", *_CABLE),
    "lika": {**_RTU, **_called_alike("alarm")},
    "magnescale": _called_alike(*_LINE, "code", *_CABLE),
}
"""By driver: what a person calls a fault, and what its emulator takes."""
_CODES = {"geocom": 1285, "ndi": 1, "dimetix": 255}
"""A code that the instrument really has; a Modbus one is 4, device failure."""


@dataclass(frozen=True)
class Wire:
    """Driver and address as settings name them, and the emulator at the other end."""

    driver: str
    address: str
    emulator: ChildProcess | None = None
    """None where the mock driver asks the world itself."""


def switch(wires: Mapping[str, Wire], words: list[str]) -> str:
    """Let a fault of one wire begin or end: part or driver, fault, then ``name=value``.

    Returns
    -------
    said
        What is now, in a sentence.

    Raises
    ------
    BadInput
        If there is no such part, fault or value.
    """
    part, wire = _wire_of(wires, words[0])
    known = FAULTS.get(wire.driver, {})
    if wire.emulator is None or not known:
        raise BadInput(part, f"is on the {wire.driver} driver, which has no wire to spoil")
    fault = words[1] if len(words) > 1 else ""
    if fault not in known:
        raise BadInput(
            part, f"has no fault {fault!r}; {wire.driver} knows {', '.join(sorted(known))}"
        )
    order = dict(known[fault])
    if set(order) == {"fault"} and fault not in ("none", "unplugged", "plugged", "reset"):
        order["replies"] = LASTING
    if fault == "late_reply":
        order["delay_s"] = _LATE_S
    if fault in ("code", "alarm"):
        order["code"] = _CODES.get(wire.driver, 4)
    answer = wire.emulator.order(order | _values(part, words[2:], order))
    if not answer.get("ok"):
        raise BadInput(part, str(answer.get("message")))
    return f"{part} ({wire.driver}): " + ("as it should be" if fault == "none" else fault)


def _wire_of(wires: Mapping[str, Wire], word: str) -> tuple[str, Wire]:
    for part, wire in wires.items():
        if word in (part, wire.driver):
            return part, wire
    raise BadInput(word, f"is none of {', '.join(wires)}")


def _values(part: str, words: list[str], order: Order) -> dict[str, object]:
    values: dict[str, object] = {}
    for word in words:
        name, _, value = word.partition("=")
        try:
            values[name] = PLACE[name](value)
        except (KeyError, ValueError):
            raise BadInput(
                part, f"does not understand {word!r}; a fault may take {', '.join(PLACE)}=NUMBER"
            ) from None
    if values and "replies" not in order:
        raise BadInput(part, f"takes no numbers with {order['fault']}")
    return values

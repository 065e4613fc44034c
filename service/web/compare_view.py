"""Two calibrations side by side: what each found, and whether they differ by more than chance."""

import math
from dataclasses import dataclass
from typing import Any

from service.web.numbers import decimals_for, fixed, signed
from service.web.result_view import SYMBOLS, UNIT_SIGNS

Json = dict[str, Any]

CLEAR = 3.0
"""Differences of more standard uncertainties than this are marked."""
_RESIDUALS = ("before", "fit", "held_out")
_IDENTIFIED = "identified"


@dataclass(frozen=True)
class ComparedParameter:
    """One parameter that both calibrations identified."""

    symbol: str
    joint: str
    unit: str
    first: str
    second: str
    difference: str
    """Second minus first."""
    std: str
    """Of the difference, the two taken as independent."""
    ratio: str
    """Difference over its standard uncertainty."""
    clear: bool


@dataclass(frozen=True)
class ComparedError:
    """RMS of a residual in both [mm]."""

    key: str
    first: str
    second: str


def compared_parameters(first: Json, second: Json) -> list[ComparedParameter]:
    """Parameters that both identified, joint by joint."""
    others = {row["name"]: row for row in second["parameters"] if row["status"] == _IDENTIFIED}
    pairs = [
        (row, others[row["name"]])
        for row in first["parameters"]
        if row["status"] == _IDENTIFIED and row["name"] in others
    ]
    decimals = {
        unit: decimals_for(row["std"] for row, _ in pairs if row["unit"] == unit)
        for unit in UNIT_SIGNS
    }
    return [_compared(one, other, decimals[one["unit"]]) for one, other in pairs]


def _compared(one: Json, other: Json, decimals: int) -> ComparedParameter:
    letter, _, joint = one["name"].rpartition("_")
    difference = other["identified"] - one["identified"]
    std = math.hypot(one["std"], other["std"])
    ratio = difference / std if std > 0.0 else 0.0
    return ComparedParameter(
        symbol=SYMBOLS[letter],
        joint=joint,
        unit=UNIT_SIGNS[one["unit"]],
        first=fixed(one["identified"], decimals),
        second=fixed(other["identified"], decimals),
        difference=signed(difference, decimals),
        std=fixed(std, decimals),
        ratio=signed(ratio, 1),
        clear=abs(ratio) > CLEAR,
    )


def compared_errors(first: Json, second: Json) -> list[ComparedError]:
    """RMS before and after, of the rows that each calibration has."""
    one, other = first["residuals"], second["residuals"]
    return [
        ComparedError(f"residuals_{key}", _rms(one[key]), _rms(other[key]))
        for key in _RESIDUALS
        if one[key] or other[key]
    ]


def _rms(summary: Json) -> str:
    return fixed(summary["position_rms_mm"], 4) if summary else ""

"""What a campaign found, as lines of text for the tables of its page."""

from dataclasses import dataclass, replace
from typing import Any

from service.web.numbers import aligned, decimals_for, fixed, nominal, signed

Json = dict[str, Any]

SYMBOLS = {"theta": "θ", "d": "d", "a": "a", "alpha": "α", "beta": "β"}
UNIT_SIGNS = {"deg": "°", "mm": "mm"}
_IDENTIFIED = "identified"
_FRAME_VALUES = ("x", "y", "z", "yaw", "pitch", "roll")
_RESIDUAL_DECIMALS = 4


@dataclass(frozen=True)
class ParameterLine:
    """One link parameter."""

    name: str
    symbol: str
    joint: str
    unit: str
    nominal: str
    identified: str
    difference: str
    std: str
    status: str
    reason: str

    @property
    def determined(self) -> bool:
        """Whether the readings determine it."""
        return self.status == _IDENTIFIED


@dataclass(frozen=True)
class FrameLine:
    """One number of the base or tool frame."""

    symbol: str
    unit: str
    value: str
    std: str
    reason: str


@dataclass(frozen=True)
class ErrorLine:
    """Size of an error over some rows."""

    key: str
    """Name of its words."""
    rows: int
    rms: str
    mean: str
    largest: str
    orientation: str


@dataclass(frozen=True)
class Verdict:
    """What the numbers say about themselves."""

    sentence: str
    tone: str


@dataclass(frozen=True)
class DriftLine:
    """How far the station moved, by the nests that stand fixed."""

    largest: str
    visits: int
    removed: bool


@dataclass(frozen=True)
class Reduction:
    """An error before and after, in mm."""

    before: str
    after: str
    percent: str
    """By how much it became smaller or larger."""
    improved: bool


def parameter_lines(identification: Json) -> list[ParameterLine]:
    """Every link parameter, joint by joint."""
    rows = identification["parameters"]
    decimals = {unit: _decimals(rows, unit) for unit in UNIT_SIGNS}
    return _aligned([_parameter_line(row, decimals[row["unit"]]) for row in rows])


def _decimals(rows: list[Json], unit: str) -> int:
    return decimals_for(
        row["std"] for row in rows if row["unit"] == unit and row["status"] == _IDENTIFIED
    )


def _aligned(lines: list[ParameterLine]) -> list[ParameterLine]:
    """Every column of numbers with its points below each other."""
    columns = {
        name: aligned([getattr(line, name) for line in lines])
        for name in ("nominal", "identified", "difference", "std")
    }
    return [
        replace(line, **{name: column[index] for name, column in columns.items()})
        for index, line in enumerate(lines)
    ]


def _parameter_line(row: Json, decimals: int) -> ParameterLine:
    letter, _, joint = row["name"].rpartition("_")
    moved = row["identified"] != row["nominal"]
    return ParameterLine(
        name=row["name"],
        symbol=SYMBOLS[letter],
        joint=joint,
        unit=UNIT_SIGNS[row["unit"]],
        nominal=nominal(row["nominal"]),
        identified=fixed(row["identified"], decimals) if moved else nominal(row["identified"]),
        difference=signed(row["identified"] - row["nominal"], decimals) if moved else "",
        std=fixed(row["std"], decimals) if row["std"] > 0.0 else "",
        status=row["status"],
        reason=row.get("reason", ""),
    )


def frame_lines(identification: Json, which: str) -> list[FrameLine]:
    """Position and orientation of `base` or `tool`."""
    frame = identification[which]
    std = [0.0 if u is None else u for u in frame["std"]]
    decimals = [decimals_for(std[:3])] * 3 + [decimals_for(std[3:])] * 3
    values = aligned(list(map(fixed, [*frame["xyz_mm"], *frame["ypr_deg"]], decimals)))
    spreads = aligned([fixed(u, d) if u > 0.0 else "" for u, d in zip(std, decimals, strict=True)])
    reasons = frame.get("redundant", {})
    return [
        FrameLine(
            name, "mm" if index < 3 else "°", value, spread, reasons.get(f"{which}_{name}", "")
        )
        for index, (name, value, spread) in enumerate(
            zip(_FRAME_VALUES, values, spreads, strict=True)
        )
    ]


def residual_lines(identification: Json) -> list[ErrorLine]:
    """Residuals before and after, over the rows that were fitted and over those held out."""
    residuals = identification["residuals"]
    return [
        _error_line(f"residuals_{key}", residuals[key]["rows"], residuals[key])
        for key in ("before", "fit", "held_out", "random_folds", "blocked_folds")
        if residuals[key]
    ]


def verification_lines(verification: Json) -> list[ErrorLine]:
    """Position error at the targets before and after compensation."""
    return [
        _error_line(f"verification_{key}", verification[key]["targets"], verification[key])
        for key in ("before", "after")
    ]


def _error_line(key: str, rows: int, summary: Json) -> ErrorLine:
    angle = summary.get("orientation_rms_deg")
    return ErrorLine(
        key=key,
        rows=rows,
        rms=fixed(summary["position_rms_mm"], _RESIDUAL_DECIMALS),
        mean=fixed(summary["position_mean_mm"], _RESIDUAL_DECIMALS),
        largest=fixed(summary["position_max_mm"], _RESIDUAL_DECIMALS),
        orientation="" if angle is None else fixed(angle, _RESIDUAL_DECIMALS),
    )


def identification_reduction(identification: Json) -> Reduction:
    """Before and after on the rows that `before` is about: the held-out ones, if there are any."""
    residuals = identification["residuals"]
    return _reduction(residuals["before"], residuals["held_out"] or residuals["fit"])


def verification_reduction(verification: Json) -> Reduction:
    """Before and after compensation."""
    return _reduction(verification["before"], verification["after"])


def _reduction(before: Json, after: Json) -> Reduction:
    after_mm, before_mm = after["position_rms_mm"], before["position_rms_mm"]
    return Reduction(
        before=fixed(before_mm, 3),
        after=fixed(after_mm, 3),
        percent=fixed(100.0 * abs(1.0 - after_mm / before_mm), 0),
        improved=after_mm <= before_mm,
    )


def adequacy_verdict(identification: Json) -> Verdict:
    """Whether the residuals are as large as the declared noise."""
    adequacy = identification["adequacy"]
    # What was stored before this was kept says it by the figure.
    judged = adequacy.get("judged", adequacy["reduced_chi_square"] is not None)
    return _verdict(
        adequacy["sentence"], good=adequacy["verdict"] == "adequate" if judged else None
    )


def intervals_verdict(uncertainty: Json) -> Verdict:
    """Whether the stated uncertainty may be believed."""
    intervals = uncertainty["intervals"]
    return _verdict(intervals["sentence"], good=intervals["hold"])


def _verdict(sentence: str, *, good: bool | None) -> Verdict:
    tone = "" if good is None else "good" if good else "caution"
    return Verdict(f"{sentence[0].upper()}{sentence[1:]}.", tone)


def drift_line(identification: Json) -> DriftLine | None:
    """How far the station moved; None where no fixed nest was visited twice."""
    drift = identification["station_drift"]
    if drift is None:
        return None
    return DriftLine(fixed(drift["largest_mm"], 3), len(drift["visits"]), drift["removed"])

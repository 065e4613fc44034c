"""`report.html`: the diagnosis for the plant engineer, in one file."""

from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.diagnosis import Diagnosis, NamedEffect, RowResiduals
from robocal.errors import BadInput
from robocal.formats.bundle import Bundle
from service.report_lines import VERDICTS

_MOST_CAUSES = 8
_WIDTH, _HEIGHT, _LEFT, _BOTTOM = 900.0, 260.0, 60.0, 24.0
_MOST_POINTS = 1500


@dataclass(frozen=True)
class CauseText:
    """One cause as the page tells it."""

    what: str
    meaning: str
    cost: float
    """RMS that it adds [mm]"""
    values: tuple[str, ...]
    probability: float
    share: float
    others: tuple[str, ...]
    in_sample_only: bool
    advice: str


def write_report(path: Path, bundle: Bundle, found: Diagnosis) -> None:
    """Write the page.

    Raises
    ------
    BadInput
        If the file cannot be written.
    """
    text = report_html(bundle, found)
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise BadInput(str(path), f"cannot be written: {error.strerror}") from None


def report_html(bundle: Bundle, found: Diagnosis) -> str:
    """The page as text."""
    environment = Environment(
        loader=PackageLoader("service", "reports"), autoescape=True, undefined=StrictUndefined
    )
    return environment.get_template("diagnosis.html").render(
        robot=bundle.robot.name,
        rows=len(bundle.measurements),
        date=found.calibrated.provenance.date,
        version=version("robocal"),
        verdict=_capital(VERDICTS[found.verdict]),
        before=found.gain.before * 1e3,
        after=found.gain.after * 1e3,
        reduction=found.gain.reduction,
        low=found.gain.ci95[0],
        high=found.gain.ci95[1],
        floor=found.noise_floor * 1e3,
        causes=[cause_text(named) for named in found.effects[:_MOST_CAUSES]],
        more=max(len(found.effects) - _MOST_CAUSES, 0),
        plot=residual_plot(found.residuals),
        faults=[
            *(f"{slip.report()} (mended before the diagnosis)" for slip in found.slips),
            *(f"measurements.csv line {row.line}: {row.reason}" for row in found.outliers),
        ],
        remains=[dependence.covariate for dependence in found.depends_on[:6]],
        between=found.next_poses.between,
        words=found.next_poses.words,
        hidden=found.hidden,
    )


def cause_text(named: NamedEffect) -> CauseText:
    """One cause in words and figures."""
    instance = named.fitted.instance
    effect = EFFECTS[instance.effect]
    gain = named.gain
    cost = np.sqrt(max(gain.before**2 - gain.after**2, 0.0))
    values = tuple(
        f"{coefficient.name} = {value:.3g} ± {std:.1g}"
        for coefficient, value, std in zip(
            instance.coefficients, named.fitted.values, named.fitted.std, strict=True
        )
    )
    others = tuple(
        f"{cause.instance.title} ({100 * cause.probability:.0f} %)"
        for cause in named.naming.causes
        if cause.key != (instance.effect, instance.joint)
    )
    return CauseText(
        what=instance.title,
        meaning=(type(effect).__doc__ or "").strip(),
        cost=float(cost) * 1e3,
        values=values,
        probability=named.probability,
        share=named.explained_fraction,
        others=others,
        in_sample_only=named.in_sample_only,
        advice=effect.advice,
    )


def residual_plot(rows: RowResiduals) -> Markup:
    """Residuals row by row as SVG, logarithmic in mm."""
    every = max(1, len(rows.lines) // _MOST_POINTS)
    index = np.arange(0, len(rows.lines), every)
    before, after = (np.maximum(values[index] * 1e3, 1e-4) for values in (rows.before, rows.after))
    low = np.floor(np.log10(min(before.min(), after.min())))
    high = np.ceil(np.log10(max(before.max(), after.max())))
    x = _LEFT + (_WIDTH - _LEFT) * (index + 0.5) / len(rows.lines)

    def height(values: float | np.ndarray) -> np.ndarray:
        share = (np.log10(values) - low) / max(high - low, 1.0)
        return np.asarray((_HEIGHT - _BOTTOM) * (1.0 - share) + 6.0)

    parts = [
        f'<svg viewBox="0 0 {_WIDTH:.0f} {_HEIGHT:.0f}" role="img" '
        'aria-label="residuals before and after, millimetres">'
    ]
    for decade in range(int(low), int(high) + 1):
        y = float(height(10.0**decade))
        parts.append(
            f'<line x1="{_LEFT}" x2="{_WIDTH}" y1="{y:.1f}" y2="{y:.1f}" stroke="var(--line)"/>'
            f'<text x="{_LEFT - 8}" y="{y + 4:.1f}" text-anchor="end">{10.0**decade:g} mm</text>'
        )
    colours = np.where(rows.held_out[index], "var(--held)", "var(--after)")
    for column, y_before, y_after, colour in zip(
        x, height(before), height(after), colours, strict=True
    ):
        parts.append(
            f'<circle cx="{column:.1f}" cy="{y_before:.1f}" r="1.8" fill="var(--before)"/>'
        )
        parts.append(f'<circle cx="{column:.1f}" cy="{y_after:.1f}" r="1.8" fill="{colour}"/>')
    parts.append("</svg>")
    return Markup("".join(parts))


def _capital(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]

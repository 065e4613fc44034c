"""Pictures of a diagnosis as SVG: residuals in the order measured, and over every covariate."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from markupsafe import Markup, escape
from numpy import ndarray as Array

from robocal.diagnosis.diagnosis import RowResiduals
from service.diagnosis_covariates import Covariates

_WIDTH, _HEIGHT, _LEFT, _BOTTOM = 900.0, 260.0, 76.0, 24.0
_MOST_POINTS = 1500
_SMALL_WIDTH, _SMALL_HEIGHT = 200.0, 100.0
_BINS = 12
_LEAST_SPREAD = 1e-9


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


@dataclass(frozen=True)
class _Curve:
    """Residuals over one covariate."""

    name: str
    ends: tuple[float, float]
    middle: Float[Array, "bin"]
    """Of the covariate in every bin."""
    before: Float[Array, "bin"]
    """RMS [mm]"""
    after: Float[Array, "bin"]
    """RMS [mm]"""


def covariate_plots(covariates: Covariates, rows: RowResiduals) -> list[Markup]:
    """RMS before and after over every covariate, all to one scale."""
    curves = [_curve(name, values, rows) for name, values in covariates.items()]
    top = max((max(curve.before.max(), curve.after.max()) for curve in curves), default=0.0)
    return [_drawn(curve, max(float(top), 1e-6)) for curve in curves]


def _curve(name: str, values: Float[Array, "row"], rows: RowResiduals) -> _Curve:
    """Root mean square in bins of equally many rows, or for each of a few values."""
    known = np.flatnonzero(np.isfinite(values))
    several = np.unique(values[known])
    if len(several) <= _BINS:
        parts = [known[values[known] == value] for value in several]
    else:
        parts = np.array_split(known[np.argsort(values[known], kind="stable")], _BINS)
    before, after = (
        np.array([np.sqrt(np.mean(sizes[part] ** 2)) for part in parts]) * 1e3
        for sizes in (rows.before, rows.after)
    )
    middle = np.array([values[part].mean() for part in parts])
    return _Curve(name, (float(several[0]), float(several[-1])), middle, before, after)


def _drawn(curve: _Curve, top: float) -> Markup:
    """Grey before and blue after, from zero to `top` [mm]."""
    span = max(float(np.ptp(curve.middle)), _LEAST_SPREAD)
    x = 8.0 + (_SMALL_WIDTH - 16.0) * (curve.middle - curve.middle[0]) / span
    lines = []
    for sizes, colour in ((curve.before, "var(--before)"), (curve.after, "var(--after)")):
        y = _SMALL_HEIGHT - 20.0 - (_SMALL_HEIGHT - 40.0) * sizes / top
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
        lines.append(
            f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2"/>'
        )
    low, high = curve.ends
    return Markup(
        f'<svg viewBox="0 0 {_SMALL_WIDTH:.0f} {_SMALL_HEIGHT:.0f}" role="img" '
        f'aria-label="residual over {escape(curve.name)}">'
        f'<line x1="8" x2="{_SMALL_WIDTH - 8}" y1="{_SMALL_HEIGHT - 20}" '
        f'y2="{_SMALL_HEIGHT - 20}" stroke="var(--line)"/>{"".join(lines)}'
        f'<text x="8" y="13">{escape(curve.name)}</text>'
        f'<text x="{_SMALL_WIDTH - 8}" y="13" text-anchor="end">{top:.2g} mm</text>'
        f'<text x="8" y="{_SMALL_HEIGHT - 5}">{low:.4g}</text>'
        f'<text x="{_SMALL_WIDTH - 8}" y="{_SMALL_HEIGHT - 5}" text-anchor="end">'
        f"{high:.4g}</text></svg>"
    )

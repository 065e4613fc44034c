"""Pictures of a diagnosis as SVG: residuals in the order measured, and over every covariate."""

import numpy as np
from markupsafe import Markup, escape

from robocal.diagnosis.diagnosis import RowResiduals
from robocal.measurements import MeasurementSet
from robocal.robots.robot import Robot

_WIDTH, _HEIGHT, _LEFT, _BOTTOM = 900.0, 260.0, 76.0, 24.0
_MOST_POINTS = 1500
_SMALL_WIDTH, _SMALL_HEIGHT = 280.0, 120.0
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


def covariate_plots(measured: MeasurementSet, robot: Robot, rows: RowResiduals) -> list[Markup]:
    """RMS before and after over every covariate that was recorded and varied."""
    order = np.searchsorted(measured.lines, rows.lines)
    joints = measured.joints / robot.joint_scale
    covariates = {
        f"joint {joint + 1} [{unit}]": joints[:, joint]
        for joint, unit in enumerate(robot.joint_units)
    }
    covariates |= {
        "time [min]": measured.time / 60.0,
        "temperature [degC]": measured.temperature,
        "payload [kg]": measured.payload,
        "speed [share of full]": measured.speed,
    }
    return [
        _over(name, values[order], rows)
        for name, values in covariates.items()
        if np.isfinite(values).all() and np.ptp(values) > _LEAST_SPREAD
    ]


def _over(name: str, values: np.ndarray, rows: RowResiduals) -> Markup:
    """Root mean square in bins of equally many rows, grey before and blue after."""
    parts = np.array_split(np.argsort(values, kind="stable"), min(_BINS, len(values)))
    middle = np.array([values[part].mean() for part in parts])
    both = [
        np.array([np.sqrt(np.mean(sizes[part] ** 2)) for part in parts]) * 1e3
        for sizes in (rows.before, rows.after)
    ]
    top = max(float(both[0].max()), float(both[1].max()), 1e-6)
    x = 8.0 + (_SMALL_WIDTH - 16.0) * (middle - middle[0]) / max(np.ptp(middle), _LEAST_SPREAD)
    drawn = []
    for sizes, colour in zip(both, ("var(--before)", "var(--after)"), strict=True):
        y = _SMALL_HEIGHT - 20.0 - (_SMALL_HEIGHT - 40.0) * sizes / top
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
        drawn.append(
            f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2"/>'
        )
    return Markup(
        f'<svg viewBox="0 0 {_SMALL_WIDTH:.0f} {_SMALL_HEIGHT:.0f}" role="img" '
        f'aria-label="residual over {escape(name)}">'
        f'<line x1="8" x2="{_SMALL_WIDTH - 8}" y1="{_SMALL_HEIGHT - 20}" '
        f'y2="{_SMALL_HEIGHT - 20}" stroke="var(--line)"/>{"".join(drawn)}'
        f'<text x="8" y="13">{escape(name)}</text>'
        f'<text x="{_SMALL_WIDTH - 8}" y="13" text-anchor="end">top {top:.3f} mm</text>'
        f'<text x="8" y="{_SMALL_HEIGHT - 5}">{values.min():.4g}</text>'
        f'<text x="{_SMALL_WIDTH - 8}" y="{_SMALL_HEIGHT - 5}" text-anchor="end">'
        f"{values.max():.4g}</text></svg>"
    )

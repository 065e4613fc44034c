"""A chart of a few lines as an SVG document, with nothing but text."""

from collections.abc import Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

_WIDTH, _HEIGHT = 760.0, 380.0
_LEFT, _TOP, _RIGHT, _BOTTOM = 70.0, 30.0, 150.0, 60.0
_COLOURS = ("#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#555555")
_STYLE = "text{font:12px sans-serif;fill:#222}.axis{stroke:#444}.grid{stroke:#ddd}"


@dataclass(frozen=True)
class Line:
    """One line of a chart; `dots` draws points instead of a stroke."""

    name: str
    x: Float[Array, "point"]
    y: Float[Array, "point"]
    dots: bool = False


@dataclass(frozen=True)
class Chart:
    """What a chart shows; with `names` the x axis counts these, else it is a number."""

    x_label: str
    y_label: str
    lines: tuple[Line, ...]
    names: tuple[str, ...] = ()
    logarithmic: bool = False


def chart_svg(chart: Chart) -> str:
    """The chart as an SVG document."""
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}">',
        f"<style>{_STYLE}</style>",
        f'<rect width="{_WIDTH:g}" height="{_HEIGHT:g}" fill="white"/>',
    ]
    scale = _Scale(chart)
    parts += scale.axes()
    for number, line in enumerate(chart.lines):
        colour = _COLOURS[number % len(_COLOURS)]
        x, y = scale.x(line.x), scale.y(line.y)
        if line.dots:
            parts += [
                f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3.5" fill="{colour}"/>'
                for a, b in zip(x, y, strict=True)
            ]
        else:
            points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
            parts.append(
                f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.6"/>'
            )
        legend = _TOP + 16.0 * number + 8.0
        parts.append(_text(_WIDTH - _RIGHT + 12.0, legend, line.name, fill=colour))
    return "\n".join([*parts, "</svg>", ""])


class _Scale:
    """Places of numbers on the page."""

    def __init__(self, chart: Chart) -> None:
        self._chart = chart
        x = np.concatenate([line.x for line in chart.lines])
        y = self._height(np.concatenate([line.y for line in chart.lines]))
        self._x = (float(x.min()), float(x.max()))
        low, high = float(y.min()), float(y.max())
        self._y = (np.floor(low), np.ceil(high)) if chart.logarithmic else (min(low, 0.0), high)

    def _height(self, y: Float[Array, "point"]) -> Float[Array, "point"]:
        return np.log10(y) if self._chart.logarithmic else y

    def x(self, x: Float[Array, "point"]) -> Float[Array, "point"]:
        low, high = self._x
        return _LEFT + (x - low) / (high - low) * (_WIDTH - _LEFT - _RIGHT)

    def y(self, y: Float[Array, "point"]) -> Float[Array, "point"]:
        low, high = self._y
        return (
            _HEIGHT - _BOTTOM - (self._height(y) - low) / (high - low) * (_HEIGHT - _TOP - _BOTTOM)
        )

    def axes(self) -> list[str]:
        """Grid, ticks and labels."""
        chart = self._chart
        right, bottom = _WIDTH - _RIGHT, _HEIGHT - _BOTTOM
        parts = []
        for value in self._ticks():
            height = float(self.y(np.array([value]))[0])
            parts.append(_across("grid", right, height))
            parts.append(_text(_LEFT - 6.0, height + 4.0, f"{value:.2g}", anchor="end"))
        if chart.names:
            for number, name in enumerate(chart.names):
                place = float(self.x(np.array([float(number)]))[0])
                parts.append(_text(place, bottom + 14.0, name, anchor="end", turn=-55.0))
        else:
            for value in np.linspace(*self._x, 6).round():
                place = float(self.x(np.array([value]))[0])
                parts.append(_text(place, bottom + 16.0, f"{value:g}", anchor="middle"))
        parts.append(_across("axis", right, bottom))
        parts.append(_text((_LEFT + right) / 2, _HEIGHT - 6.0, chart.x_label, anchor="middle"))
        parts.append(_text(_LEFT, _TOP - 12.0, chart.y_label))
        return parts

    def _ticks(self) -> Sequence[float]:
        low, high = self._y
        if self._chart.logarithmic:
            return [float(10.0**power) for power in range(int(low), int(high) + 1)]
        return [float(value) for value in np.linspace(low, high, 6)]


def _across(kind: str, right: float, height: float) -> str:
    return f'<line class="{kind}" x1="{_LEFT}" x2="{right}" y1="{height:.1f}" y2="{height:.1f}"/>'


def _text(
    x: float, y: float, text: str, anchor: str = "start", fill: str = "#222", turn: float = 0.0
) -> str:
    turned = f' transform="rotate({turn:g} {x:.1f} {y:.1f})"' if turn else ""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" style="fill:{fill}"{turned}>'
        f"{escape(text)}</text>"
    )

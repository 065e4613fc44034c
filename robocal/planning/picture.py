"""`plan.svg`: the planned poses in space, seen from above and from the side, and the index curve.

Colour runs from the first visit (blue) to the last (orange); the thin lines are the arm.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from xml.sax.saxutils import escape

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.planning.capsules import arm_shape
from robocal.planning.observability import INDICES
from robocal.planning.plan import Plan

_PANEL = 380.0
_GAP = 60.0
_FIRST, _LAST = np.array([31, 119, 180]), np.array([255, 127, 14])
_STYLE = (
    "text{font:12px sans-serif;fill:#222}.arm{fill:none;stroke:#888;stroke-opacity:.25}"
    ".edge{fill:none;stroke:#444}.box{fill:none;stroke:#2a7;stroke-dasharray:5 4}"
    ".station{fill:#c22}.curve{fill:none;stroke:#1f77b4;stroke-width:1.5}"
    ".chosen{fill:#ff7f0e}"
)


@dataclass(frozen=True)
class _View:
    """A square panel that shows two axes of the robot base."""

    left: float
    across: int
    up: int
    centre: Float[Array, "3"]
    half: float
    """Half of the length shown [m]."""

    def at(self, point: Float[Array, "3"]) -> tuple[float, float]:
        """Place of a point in the picture."""
        scale = _PANEL / (2.0 * self.half)
        x = self.left + _PANEL / 2.0 + (point[self.across] - self.centre[self.across]) * scale
        y = _GAP + _PANEL / 2.0 - (point[self.up] - self.centre[self.up]) * scale
        return float(x), float(y)


def plan_picture(plan: Plan) -> str:
    """The picture as an SVG document."""
    shape = arm_shape(plan.rows.model, plan.visits.q, plan.request.cell.floor or 0.0)
    joints = np.stack([segment.start for segment in shape.segments] + [shape.target])
    points = joints.transpose(2, 0, 1)  # (visit, joint, 3)
    shown = [points.reshape(-1, 3)]
    if plan.request.cell.box is not None:
        shown.append(np.array([plan.request.cell.box.low, plan.request.cell.box.high]))
    every = np.concatenate(shown)
    low, high = every.min(axis=0), every.max(axis=0)
    half = float((high - low).max()) * 0.53
    width, height = 3 * _PANEL + 4 * _GAP, _PANEL + 2 * _GAP
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" '
        f'width="{width:.0f}" height="{height:.0f}" role="img">',
        f"<title>{escape(plan.request.robot.name)}: {len(plan.chosen)} poses, "
        f"{len(points)} visits</title><style>{_STYLE}</style>"
        '<rect width="100%" height="100%" fill="#fff"/>',
    ]
    for number, (title, across, up) in enumerate((("from above", 0, 1), ("from the side", 0, 2))):
        left = _GAP + number * (_PANEL + _GAP)
        view = _View(left, across, up, (low + high) / 2.0, half)
        parts += _panel(plan, view, points, title)
    parts += _curve(plan, 3 * _GAP + 2 * _PANEL)
    return "\n".join([*parts, "</svg>", ""])


def _panel(
    plan: Plan, view: _View, points: Float[Array, "visit joint 3"], title: str
) -> Iterable[str]:
    """One view: frame, arms, targets in visiting order, box and tracker."""
    axis = "xyz"[view.across], "xyz"[view.up]
    side = 2.0 * view.half * 1e3
    yield (
        f'<rect class="edge" x="{view.left:.0f}" y="{_GAP:.0f}" width="{_PANEL:.0f}" '
        f'height="{_PANEL:.0f}"/><text x="{view.left:.0f}" y="{_GAP - 10:.0f}">{title}: '
        f"{axis[0]} right, {axis[1]} up, side {side:.0f} mm</text>"
    )
    for arm in points:
        line = " ".join("{:.1f},{:.1f}".format(*view.at(point)) for point in arm)
        yield f'<polyline class="arm" points="{line}"/>'
    share = np.linspace(0.0, 1.0, len(points))[:, None]
    colours = np.round(_FIRST + (_LAST - _FIRST) * share).astype(int)
    for number, (arm, colour) in enumerate(zip(points, colours, strict=True), start=1):
        x, y = view.at(arm[-1])
        red, green, blue = (int(part) for part in colour)
        yield (
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="rgb({red},{green},{blue})">'
            f"<title>visit {number}, pose {plan.visits.pose[number - 1]}</title></circle>"
        )
    cell = plan.request.cell
    if cell.box is not None:
        x0, y0 = view.at(np.array(cell.box.low))
        x1, y1 = view.at(np.array(cell.box.high))
        yield (
            f'<rect class="box" x="{x0:.1f}" y="{y1:.1f}" width="{x1 - x0:.1f}" '
            f'height="{y0 - y1:.1f}"/>'
        )
    if cell.station is not None:
        # Far from the arm as it mostly is, the tracker stands on the frame, in its direction.
        x, y = view.at(np.array(cell.station.position))
        x = min(max(x, view.left), view.left + _PANEL)
        y = min(max(y, _GAP), _GAP + _PANEL)
        yield (
            f'<circle class="station" cx="{x:.1f}" cy="{y:.1f}" r="5"/>'
            f'<text x="{x - 8:.1f}" y="{y - 8:.1f}" text-anchor="end">tracker</text>'
        )


def _curve(plan: Plan, left: float) -> Iterable[str]:
    """The index against the number of random poses, and the chosen set on it."""
    name = plan.request.merit if plan.request.merit in INDICES else next(iter(INDICES))
    counts, mean = plan.curve.counts, plan.curve.mean[name]
    most = float(max(counts[-1], len(plan.chosen)))
    top = float(max(mean.max(), plan.indices[name])) * 1.05
    bottom = _GAP + _PANEL

    def at(count: float, value: float) -> str:
        return f"{left + count / most * _PANEL:.1f},{bottom - value / top * _PANEL:.1f}"

    line = " ".join(at(float(count), value) for count, value in zip(counts, mean, strict=True))
    x, y = at(len(plan.chosen), plan.indices[name]).split(",")
    yield (
        f'<rect class="edge" x="{left:.0f}" y="{_GAP:.0f}" width="{_PANEL:.0f}" '
        f'height="{_PANEL:.0f}"/><text x="{left:.0f}" y="{_GAP - 10:.0f}">{name} of random sets '
        f"against poses (0 to {most:.0f}; 0 to {top:.3g}); dot: this plan</text>"
        f'<polyline class="curve" points="{line}"/>'
        f'<circle class="chosen" cx="{x}" cy="{y}" r="5"/>'
    )

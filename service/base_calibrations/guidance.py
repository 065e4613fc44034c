"""Which touch comes next, and why: first those of document 001, figure 2, then the surest.

Figure 2: the master's needle in the rod cup (P1, the rod pointing back along the guide) and in the
slide cup (P2); the slide is moved to the slave; the slave's needle in the rod cup in two positions
(R1, R2). From then on the registration answers and the best next touch is that of the least
predicted uncertainty.
"""

from collections.abc import Sequence
from typing import Any

from service.base_calibrations.models import Cup, NextTouch, Role, StageSettings, Step, Touch

ENOUGH_SHARE = 0.95
"""A further touch that leaves more than this share of the uncertainty is hardly worth the time."""

_WHY = {
    Step.p1: (
        "The master finds the stage: its needle in the rod cup, the rod pointing back along the "
        "guide. Any slide position and rod length that the master reaches will do."
    ),
    Step.p2: (
        "The master finds the stage's direction: its needle in the slide cup, the slide where it "
        "stands."
    ),
    Step.r1: (
        "The slide carries the place over to the slave: move it until the slave reaches the rod "
        "cup, turn the rod towards the slave."
    ),
    Step.r2: (
        "The slave finds the stage's direction: the rod cup again, at another angle and length, "
        "the slide clamped where it stands."
    ),
}


def next_touch(
    stage: StageSettings, touches: Sequence[Touch], assessment: dict[str, Any] | None
) -> NextTouch | None:
    """Return the touch to make next; None where no further one is in reach.

    Parameters
    ----------
    touches
        Those that count.
    assessment
        Of these touches, where there is one.
    """
    step = _first_missing(touches)
    if step is not None:
        return _figure_2(step, stage, touches)
    if assessment is None or assessment["next_touch"] is None:
        return None
    return _best(assessment["next_touch"], assessment["undetermined"])


def two_by_each(touches: Sequence[Touch]) -> bool:
    """Whether both robots have touched twice without the stage being moved between."""
    made = [(touch.placement, touch.robot) for touch in touches]
    return any(
        min(made.count((placement, role)) for role in Role) >= 2
        for placement in {placement for placement, _ in made}
    )


def _first_missing(touches: Sequence[Touch]) -> Step | None:
    if two_by_each(touches):
        return None
    here = [touch for touch in touches if touch.placement == touches[-1].placement]
    by_master = [touch.cup for touch in here if touch.robot is Role.master]
    by_slave = [touch for touch in here if touch.robot is Role.slave]
    if len(by_master) < 2:
        return Step.p2 if Cup.rod in by_master else Step.p1
    return Step.r2 if by_slave else Step.r1


def _figure_2(step: Step, stage: StageSettings, touches: Sequence[Touch]) -> NextTouch:
    near, far = stage.slide_range_mm
    angles, lengths = stage.rod_angle_range_deg, stage.rod_length_range_mm
    made = touches[-1] if touches else None
    role = Role.master if step in (Step.p1, Step.p2) else Role.slave
    stands = made.slide_mm if made is not None and made.robot is role else None
    slide = stands if stands is not None else (near if role is Role.master else far)
    places: dict[Step, tuple[float | None, float | None]] = {
        Step.p1: (min(max(0.0, angles[0]), angles[1]), _between(lengths, 0.5)),
        Step.p2: (None, None),
        Step.r1: (_between(angles, 0.25), lengths[0]),
        Step.r2: (_between(angles, 0.75), lengths[1]),
    }
    angle, length = places[step]
    return NextTouch(
        step=step,
        robot=role,
        cup=Cup.slide if step is Step.p2 else Cup.rod,
        slide_mm=slide,
        rod_angle_deg=angle,
        rod_length_mm=length,
        place_mm=None,
        uncertainty_before_mm=None,
        uncertainty_after_mm=None,
        why=_WHY[step],
    )


def _between(ends: tuple[float, float], share: float) -> float:
    return ends[0] + share * (ends[1] - ends[0])


def _best(proposal: dict[str, Any], undetermined: Sequence[dict[str, str]]) -> NextTouch:
    before, after = proposal["uncertainty_before_mm"], proposal["uncertainty_after_mm"]
    if undetermined:
        left_open = "; ".join(entry["direction"] for entry in undetermined)
        why = f"Still open: {left_open}. Of all touches in reach this one tells most about it."
    elif after > ENOUGH_SHARE * before:
        why = (
            "The touches may be enough: the best further one would bring the predicted position "
            f"uncertainty of the slave over its reach only from {before:.3g} to {after:.3g} mm."
        )
    else:
        why = (
            "Of all touches in reach this one helps most: predicted position uncertainty of the "
            f"slave over its reach from {before:.3g} to {after:.3g} mm."
        )
    return NextTouch(step=Step.best, why=why, **proposal)

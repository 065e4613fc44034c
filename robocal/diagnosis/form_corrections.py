"""Which small effects only mend the form of a larger one.

The catalogue's forms are right to about a tenth: masses are stated roughly, springs harden. What is
left of a large effect then looks like some small effect that resembles it. Such a one stays in the
model, but it is no cause of its own. Where the large one follows the load and the masses are
stated, or where the arm grows, its other forms are known: what these take up is its form, and what
they cannot is a cause.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Follows, Instance
from robocal.diagnosis.evidence import log_bayes_factor
from robocal.diagnosis.extended import FittedEffect
from robocal.diagnosis.joint_fit import JointFit, effect_columns
from robocal.diagnosis.linearised import Linearised
from robocal.diagnosis.open_forms import beside_forms, other_forms
from robocal.diagnosis.step_sweep import STEPS

FORM_SHARE = 0.025
"""Of the square of an effect: a form that is wrong by a sixth; [1]"""
MENDING_SHARE = 0.15
"""Of the same: what a correction may amount to before the others take their part back; [1]"""
ALIKE = 0.5
"""Cosine after projection from which one effect resembles another; [1]"""
BEYOND_FORMS = 6.0
"""Log Bayes factor, beside the large effect's other forms, from which a small one is a cause: odds
of 400, about as many as there are effects that it might have looked like; [1]"""
NOTHING_LEFT, TAKEN_UP = 1.0, 2.5
"""Below the one, and the other below what it was without these forms, it only stands for them,
whatever it resembles; [1]"""


_MENDED_BY = {
    Follows.angle: {Follows.angle},
    # Masses that are stated wrongly leave a torque that follows angles.
    Follows.load: {Follows.load, Follows.angle, Follows.sight},
    Follows.motion: {Follows.motion, Follows.angle},
    Follows.time: {Follows.time},
    Follows.sight: {Follows.sight, Follows.angle, Follows.load},
}
"""What the remainder of an effect whose form is wrong may follow."""


def may_mend(main: Instance, small: Instance) -> bool:
    """Whether the form of an effect can be wrong that way; a step that creeps is more steps."""
    if main.effect in STEPS or small.effect in STEPS:
        return small.effect == main.effect
    return EFFECTS[small.effect].follows in _MENDED_BY[EFFECTS[main.effect].follows]


def places_of(instances: tuple[Instance, ...], evidence: Float[Array, "effect"]) -> list[list[int]]:
    """Positions of the effects by the place where they act, the strongest form of each first."""
    places: dict[tuple[object, ...], list[int]] = {}
    for position in np.argsort(-evidence).tolist():
        places.setdefault(instances[position].place, []).append(position)
    return list(places.values())


def causes_and_forms(
    rows: Circumstances,
    found: JointFit,
    fit: Linearised,
    places: list[list[int]],
    dropped: Float[Array, "place"],
) -> list[list[int]]:
    """Positions of the effects in groups: a cause first, then what mends its form.

    Parameters
    ----------
    rows
        Circumstances of the rows of `fit`.
    found
        The model.
    fit
        Its linear algebra, or that of some rows, in the units of `dropped`.
    places
        `places_of` the model.
    dropped
        Rise of the squared residual without what acts there, all else refitted; for all rows.
    """
    bare = replace(fit, more=fit.more[:, :0], more_precision=np.zeros(0))
    parts = [_part(rows, found, bare, place) for place in places]
    scale = found.fit.n_rows / fit.n_rows
    groups: list[list[int]] = []
    for index in np.argsort(-dropped).tolist():
        drop = float(dropped[index]) / scale
        for group in groups:
            if _mends(rows, found, fit, parts[group[0]], parts[index], drop):
                group.append(index)
                break
        else:
            groups.append([index])
    return [[position for index in group for position in places[index]] for group in groups]


@dataclass(frozen=True)
class _Part:
    """What acts at one place, after projection out of the geometry."""

    positions: list[int]
    effects: tuple[FittedEffect, ...]
    size: float
    """Sum of its squares."""
    directions: Float[Array, "scalar k"]


def _part(rows: Circumstances, found: JointFit, bare: Linearised, place: list[int]) -> _Part:
    effects = tuple(found.effects[position] for position in place)
    X, _ = effect_columns(bare, rows, tuple(fitted.instance for fitted in effects))
    X = X - bare.basis @ (bare.basis.T @ X)
    size = float(np.sum((X @ np.concatenate([fitted.values for fitted in effects])) ** 2))
    return _Part(place, effects, size, np.linalg.qr(X)[0])


def _mends(
    rows: Circumstances, found: JointFit, fit: Linearised, main: _Part, small: _Part, dropped: float
) -> bool:
    """Whether a small effect is but the form of a large one."""
    if small.size >= MENDING_SHARE * main.size:
        return False
    large = main.effects[0].instance
    alike = float(np.linalg.norm(main.directions.T @ small.directions, 2))
    resembles = may_mend(large, small.effects[0].instance) and alike > ALIKE
    resembles = resembles and dropped < FORM_SHARE * main.size
    forms = other_forms(rows, main.effects)
    if not forms:
        return resembles
    X, precision = effect_columns(fit, rows, tuple(fitted.instance for fitted in small.effects))

    def strength(rest: Linearised) -> float:
        return float(log_bayes_factor(*rest.scored(X), precision**-0.5))

    rest = found.without(fit, *small.positions)
    alone, beside = strength(rest), strength(beside_forms(rest, forms))
    taken_up = beside < min(NOTHING_LEFT, alone - TAKEN_UP)
    return taken_up or (resembles and beside < BEYOND_FORMS)

"""Which small effects only mend the form of a larger one.

The catalogue's forms are right to about a tenth: masses are stated roughly, springs harden. What is
left of a large effect then looks like some small effect that resembles it. Such a one stays in the
model, but it is no cause of its own.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Follows, Instance
from robocal.diagnosis.joint_fit import JointFit
from robocal.diagnosis.linearised import Linearised
from robocal.diagnosis.step_sweep import STEPS

FORM_SHARE = 0.025
"""Of the square of an effect: a form that is wrong by a sixth; [1]"""
MENDING_SHARE = 0.15
"""Of the same: what a correction may amount to before the others take their part back; [1]"""
ALIKE = 0.5
"""Cosine after projection from which one effect resembles another; [1]"""


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


def causes_and_forms(
    rows: Circumstances, found: JointFit, fit: Linearised, dropped: Float[Array, "effect"]
) -> list[list[int]]:
    """Positions of the effects in groups: a cause first, then what mends its form.

    Parameters
    ----------
    rows
        Circumstances of the rows of `fit`.
    found
        The model.
    fit
        Its linear algebra without the effects' columns, in the units of `dropped`.
    dropped
        Rise of the squared residual without each effect, the others refitted; for all rows.
    """
    directions, sizes = [], []
    for fitted in found.effects:
        X = fit.columns(EFFECTS[fitted.instance.effect].moves(rows, fitted.instance))
        X = X - fit.basis @ (fit.basis.T @ X)
        sizes.append(float(np.sum((X @ fitted.values) ** 2)))
        directions.append(np.linalg.qr(X)[0])
    scale = found.fit.n_rows / fit.n_rows
    groups: list[list[int]] = []
    for position in np.argsort(-dropped).tolist():
        instance = found.effects[position].instance
        for group in groups:
            main = group[0]
            small = dropped[position] < FORM_SHARE * sizes[main] * scale
            small &= sizes[position] < MENDING_SHARE * sizes[main]
            alike = np.linalg.norm(directions[main].T @ directions[position], 2)
            mends = small and alike > ALIKE and may_mend(found.effects[main].instance, instance)
            if mends or found.effects[main].instance.place == instance.place:
                group.append(position)
                break
        else:
            groups.append([position])
    return groups

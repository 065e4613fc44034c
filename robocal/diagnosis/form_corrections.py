"""Which small effects only mend the form of a larger one.

The catalogue's forms are right to about a tenth: masses are stated roughly, springs harden. What is
left of a large effect then looks like some small effect that resembles it. Such a one stays in the
model, but it is no cause of its own. Where the large one follows the load and the masses are
stated, its other forms are known: what these take up is its form, and what they cannot is a cause.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Follows, Instance
from robocal.diagnosis.evidence import log_bayes_factor
from robocal.diagnosis.joint_fit import JointFit
from robocal.diagnosis.linearised import Linearised
from robocal.diagnosis.open_forms import beside_forms
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
        Its linear algebra, or that of some rows, in the units of `dropped`.
    dropped
        Rise of the squared residual without each effect, the others refitted; for all rows.
    """
    alike = _Likeness(rows, found, fit)
    scale = found.fit.n_rows / fit.n_rows
    groups: list[list[int]] = []
    for position in np.argsort(-dropped).tolist():
        for group in groups:
            main = group[0]
            same = found.effects[main].instance.place == found.effects[position].instance.place
            if same or alike.mends(main, position, float(dropped[position]) / scale):
                group.append(position)
                break
        else:
            groups.append([position])
    return groups


class _Likeness:
    """Which effects of a model resemble which, after projection out of the geometry."""

    def __init__(self, rows: Circumstances, found: JointFit, fit: Linearised) -> None:
        self.rows, self.found, self.fit = rows, found, fit
        bare = replace(fit, more=fit.more[:, :0], more_precision=np.zeros(0))
        self.directions, self.sizes = [], []
        for fitted in found.effects:
            X = fit.columns(EFFECTS[fitted.instance.effect].moves(rows, fitted.instance))
            X = X - bare.basis @ (bare.basis.T @ X)
            self.sizes.append(float(np.sum((X @ fitted.values) ** 2)))
            self.directions.append(np.linalg.qr(X)[0])

    def mends(self, main: int, small: int, dropped: float) -> bool:
        """Whether a small effect is but the form of a large one."""
        if self.sizes[small] >= MENDING_SHARE * self.sizes[main]:
            return False
        large, fitted = self.found.effects[main], self.found.effects[small]
        alike = np.linalg.norm(self.directions[main].T @ self.directions[small], 2)
        resembles = may_mend(large.instance, fitted.instance) and bool(alike > ALIKE)
        resembles = resembles and dropped < FORM_SHARE * self.sizes[main]
        follows = EFFECTS[large.instance.effect].follows
        if follows is not Follows.load or self.rows.robot.masses is None:
            return resembles
        X = self.fit.columns(EFFECTS[fitted.instance.effect].moves(self.rows, fitted.instance))

        def strength(rest: Linearised) -> float:
            return float(log_bayes_factor(*rest.scored(X), fitted.instance.prior_std))

        rest = self.found.without(self.fit, small)
        alone, beside = strength(rest), strength(beside_forms(self.rows, rest, large))
        taken_up = beside < min(NOTHING_LEFT, alone - TAKEN_UP)
        return taken_up or (resembles and beside < BEYOND_FORMS)

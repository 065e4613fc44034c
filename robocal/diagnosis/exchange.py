"""Effects exchanged for a cause that fits their place better, once the others are in the model.

The first effect to enter had to stand for all that was there. When the others have come its place
may be another's: so every place is weighed against the whole catalogue again.
"""

import numpy as np

from robocal.diagnosis.causes import name_cause
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Instance
from robocal.diagnosis.joint_fit import JointFit, fit_jointly
from robocal.identification.strategy import Problem

_ROUNDS = 3
_MOST_WEIGHED = 10
"""Dozens of effects stand for structure, not each for a cause; they are left as they are; [1]"""


def exchange_effects(problem: Problem, rows: Circumstances, found: JointFit) -> JointFit:
    """The model with every effect the most probable one for its place; itself if it is already.

    Parameters
    ----------
    problem
        Of the geometric fit.
    rows
        Circumstances of the same rows.
    found
        The model so far.
    """
    tried = {tuple(fitted.instance for fitted in found.effects)}
    for _ in range(_ROUNDS):
        instances = _with_better(rows, found)
        if instances is None or instances in tried:
            break
        tried.add(instances)
        found = fit_jointly(problem, found.cell, rows, instances, found.effects)
    return found


def _with_better(rows: Circumstances, found: JointFit) -> tuple[Instance, ...] | None:
    """The model's effects with the first one exchanged that another cause would replace."""
    instances = [fitted.instance for fitted in found.effects]
    if len(instances) > _MOST_WEIGHED:
        return None
    # The weakest place first: what is strong is mostly what it seems.
    for position in np.argsort(found.evidence_of_effects()).tolist():
        naming = name_cause(rows, found.without(found.judged, position))
        if not naming.causes:
            continue
        best = naming.causes[0]
        others = {(i.effect, i.joint) for i in instances}
        if best.key not in others and best.probability > naming.none:
            instances[position] = best.instance
            return tuple(instances)
    return None

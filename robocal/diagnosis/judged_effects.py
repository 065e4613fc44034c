"""Every effect of the model judged: its causes, its share, and what the model loses without it."""

import numpy as np
from jaxtyping import Bool
from numpy import ndarray as Array

from robocal.diagnosis.causes import itself_or_nothing, name_cause
from robocal.diagnosis.diagnosis import NamedEffect
from robocal.diagnosis.gain import blocks_of, gain_of
from robocal.diagnosis.joint_fit import JointFit
from robocal.diagnosis.left_out import LeftOut
from robocal.diagnosis.select import without
from robocal.diagnosis.target_distances import Targets
from robocal.diagnosis.thinning import chosen_rows, evenly

_MOST_NAMED = 10
"""Effects, the largest first, whose place is weighed against the whole catalogue; [1]"""
_MOST_WEIGHED = 2000
"""Rows that this takes; more are thinned out evenly; [1]"""


def judge_effects(
    targets: Targets,
    fitted: Array,
    judged: Bool[Array, "row"],
    geometric: JointFit,
    found: JointFit,
) -> list[NamedEffect]:
    """Judge every effect, most important first.

    Parameters
    ----------
    targets
        All rows.
    fitted
        Indices of the rows that the fit is of.
    judged
        Rows that the gain is measured on.
    geometric, found
        The fit without effects, and with them.
    """
    pose = targets.measured.pose
    left_out = LeftOut(found.judged, blocks_of(pose[fitted]))
    full = left_out.sizes()
    kept = [found.columns_without(position) for position in range(len(found.effects))]
    less = [left_out.without(k, f.values) for k, f in zip(kept, found.effects, strict=True)]
    now = float(found.judged.r @ found.judged.r)
    dropped = np.array([(chi_square - now) * found.scale**2 for _, chi_square in less])
    structure = max(geometric.chi_square - found.chi_square, 1e-300)
    evidence = found.evidence_of_effects()
    order = np.argsort(-dropped)
    leading = set(order[:_MOST_NAMED].tolist())
    seen = targets.some(judged)
    after = seen.with_all(found)
    lacking = list(seen.with_one_less(found))
    few = evenly(len(fitted), _MOST_WEIGHED)
    some = targets.around.rows(chosen_rows(fitted[few], len(pose)))
    some_fit = found.judged.some_rows(few)
    named = [
        NamedEffect(
            fitted=effect,
            naming=name_cause(some, without(found, some_fit, position))
            if position in leading
            else itself_or_nothing(effect.instance, float(evidence[position])),
            explained_fraction=float(np.clip(dropped[position] / structure, 0.0, 1.0)),
            gain=gain_of(lacking[position], after, pose[judged]),
            blocked_gain=gain_of(less[position][0], full, pose[fitted]),
        )
        for position, effect in enumerate(found.effects)
    ]
    return [named[position] for position in order]

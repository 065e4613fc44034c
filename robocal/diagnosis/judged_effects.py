"""Every effect of the model judged: its causes, its share, and what the model loses without it."""

from collections.abc import Sequence

import numpy as np
from numpy import ndarray as Array

from robocal.diagnosis.causes import Naming, itself_or_nothing, name_cause
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.diagnosis import NamedEffect
from robocal.diagnosis.form_corrections import causes_and_forms, places_of
from robocal.diagnosis.gain import blocks_of, gain_of
from robocal.diagnosis.joint_fit import JointFit
from robocal.diagnosis.left_out import LeftOut
from robocal.diagnosis.linearised import Linearised
from robocal.diagnosis.target_distances import Targets
from robocal.diagnosis.thinning import chosen_rows, evenly
from robocal.diagnosis.unlisted import Block, blocks
from robocal.diagnosis.unseen import Unseen
from robocal.progress import counted

_MOST_NAMED = 10
"""Effects, the largest first, whose place is weighed against the whole catalogue; [1]"""
_MOST_WEIGHED = 2000
"""Rows that this takes; more are thinned out evenly; [1]"""


def judge_effects(
    targets: Targets,
    fitted: Array,
    judged: Unseen,
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
        Rows that the gain is measured on, with the models that predict them.
    geometric, found
        The fit without effects, and with them.
    """
    if not found.effects:
        return []
    pose = targets.measured.pose
    now = float(found.judged.r @ found.judged.r)
    values = np.concatenate([effect.values for effect in found.effects])
    left_out = LeftOut(found.judged, blocks_of(pose[fitted]))
    full = left_out.sizes()
    n_free = len(found.fit.free)

    def lacking(positions: list[int]) -> tuple[Array, float]:
        kept = found.columns_without(*positions)
        sizes, chi_square = left_out.without(kept, values[~kept[n_free:]])
        return sizes, chi_square - now

    evidence = found.evidence_of_effects()
    instances = tuple(effect.instance for effect in found.effects)
    places = places_of(instances, evidence)
    dropped = np.array([lacking(place)[1] for place in places])
    few = evenly(len(fitted), _MOST_WEIGHED)
    some = targets.around.rows(chosen_rows(fitted[few], len(pose)))
    some_fit = found.judged.some_rows(few)
    groups = causes_and_forms(some, found, some_fit, places, dropped)
    without_group = [lacking(group) for group in groups]
    order = np.argsort([-drop for _, drop in without_group]).tolist()
    structure = max((geometric.chi_square - found.chi_square) / found.scale**2, 1e-300)
    after, judged_pose = judged.with_all(), judged.pose
    beside = blocks(some, some_fit)
    named = []
    for rank, index in enumerate(counted("causes judged", order, len(order))):
        group, (sizes, drop) = groups[index], without_group[index]
        gone = {instances[position] for position in group}
        main = found.effects[group[0]]
        naming = (
            _name(some, found, some_fit, group, beside)
            if rank < _MOST_NAMED
            else itself_or_nothing(main.instance, float(evidence[group[0]]))
        )
        named.append(
            NamedEffect(
                fitted=main,
                naming=naming,
                explained_fraction=float(np.clip(drop / structure, 0.0, 1.0)),
                gain=gain_of(judged.without(gone, set(instances) - gone), after, judged_pose),
                blocked_gain=gain_of(sizes, full, pose[fitted]),
                form_corrections=tuple(found.effects[position] for position in group[1:]),
            )
        )
    return named


def _name(
    rows: Circumstances,
    found: JointFit,
    fit: Linearised,
    group: list[int],
    beside: Sequence[Block],
) -> Naming:
    """Weigh the place of a cause and of what mends its form against the whole catalogue."""
    main, place = group[0], found.effects[group[0]].instance.place
    naming = name_cause(rows, found.without(fit, *group), beside)
    otherwise = [i for i in group if i == main or found.effects[i].instance.place != place]
    itself = found.effects[main].instance.effect, found.effects[main].instance.joint
    if len(otherwise) == len(group) or (naming.causes and naming.causes[0].key == itself):
        return naming
    # It acts in two forms at once, and neither alone is the best cause: the other one stays.
    return name_cause(rows, found.without(fit, *otherwise), beside)

"""What the rest goes with, once the causes are in the model."""

from collections import Counter

from robocal.diagnosis.causes import UNLISTED
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.covariates import SIGNIFICANT, Dependence, dependences
from robocal.diagnosis.diagnosis import NamedEffect
from robocal.diagnosis.joint_fit import JointFit, fit_jointly
from robocal.diagnosis.step_sweep import STEPS
from robocal.diagnosis.thinning import evenly
from robocal.identification.strategy import Problem

_MOST_STEPS = 2
"""Steps of one kind up to which each is what it seems, such as a nest that slips twice; [1]"""
_MOST_DEPENDENT = 2000
"""Rows that the covariates are tried on; more are thinned out evenly; [1]"""


def depends_on(
    problem: Problem, rows: Circumstances, found: JointFit, effects: list[NamedEffect]
) -> tuple[Dependence, ...]:
    """Covariates of what is left, and of causes outside the catalogue, the strongest first."""
    both = (*_outside(effects), *_left(problem, rows, found))
    ordered = sorted(both, key=lambda dependence: dependence.p_value)
    strongest = {dependence.covariate: dependence for dependence in reversed(ordered)}
    return tuple(sorted(strongest.values(), key=lambda dependence: dependence.p_value))


def _left(problem: Problem, rows: Circumstances, found: JointFit) -> tuple[Dependence, ...]:
    """Of what is left; many steps of one kind are no answer but a sign of some drift.

    So the covariates are tried without them.
    """
    steps = Counter((f.instance.effect, f.instance.joint) for f in found.effects)
    chain = [key for key, count in steps.items() if key[0] in STEPS and count > _MOST_STEPS]
    if chain:
        rest = tuple(
            f.instance for f in found.effects if (f.instance.effect, f.instance.joint) not in chain
        )
        found = fit_jointly(problem, found.cell, rows, rest, found.effects)
    few = evenly(len(rows), _MOST_DEPENDENT)
    depends = dependences(rows.rows(few), found.judged.some_rows(few))
    return tuple(dependence for dependence in depends if dependence.p_value < SIGNIFICANT)


def _outside(effects: list[NamedEffect]) -> list[Dependence]:
    """What the causes go with that most probably are outside the catalogue."""
    moved_by = [e.naming.moved_by for e in effects if e.naming.unlisted > UNLISTED]
    return [Dependence(one.covariate, one.p_value) for one in moved_by if one is not None]

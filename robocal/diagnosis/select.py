"""Several effects at once: forward with a joint fit after each, and a backward look at every one.

One-step naming fails when small other effects stand behind the main one; selecting step by step and
judging each effect again, given all the others, repairs it.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.alarm import named_evidence
from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Instance
from robocal.diagnosis.evidence import log_sum_exp
from robocal.diagnosis.exchange import exchange_effects
from robocal.diagnosis.group import Group
from robocal.diagnosis.joint_fit import JointFit, fit_jointly
from robocal.diagnosis.linearised import Linearised
from robocal.diagnosis.refine import refine
from robocal.diagnosis.screen import screen
from robocal.diagnosis.thinning import evenly
from robocal.identification.cell_model import CellModel
from robocal.identification.strategy import Problem
from robocal.progress import tell

_ALIKE = 0.3
"""Candidates of one round must be less alike than this (cosine after projection); [1]"""
_ROUND_SHARE = 0.05
"""Candidates of one round need this share of the best one's evidence; [1]"""
_MOST_SCREENED = 2000
"""Rows that choose; more are thinned out evenly; [1]"""
_ROUNDS_ON_ALL = 2
"""Rounds of selection on all rows after that; [1]"""
_EXCHANGES = 2
"""Times that an exchange of effects may be followed by further selection; [1]"""
_CERTAIN = 30.0
"""Only rounds with this much evidence take several candidates at once; [1]"""


@dataclass(frozen=True)
class Limits:
    """When to stop."""

    threshold: float
    """Named evidence below which nothing more is named."""
    most: int
    """Effects at most."""


def select_effects(
    problem: Problem, start: CellModel, rows: Circumstances, limits: Limits
) -> JointFit:
    """The effects that the rows speak for, fitted together with the geometry.

    Where there are many rows an even share of them chooses most effects; all of them decide what
    stays and what else shows.
    """
    few = evenly(len(rows), _MOST_SCREENED)
    some = replace(problem, rows=problem.rows.choose(few))
    some_rows = rows.rows(few)
    found = _grow(some, some_rows, fit_jointly(some, start, some_rows, ()), limits, limits.most)
    for _ in range(_EXCHANGES):
        exchanged = exchange_effects(some, some_rows, found)
        if exchanged is found:
            break
        found = _grow(some, some_rows, exchanged, limits, limits.most)
    if few.all():
        return found
    instances = tuple(fitted.instance for fitted in found.effects)
    found = fit_jointly(problem, found.cell, rows, instances, found.effects)
    return _grow(problem, rows, found, limits, _ROUNDS_ON_ALL)


def _grow(
    problem: Problem, rows: Circumstances, found: JointFit, limits: Limits, rounds: int
) -> JointFit:
    """Forward with a joint fit after each round, and a backward look at every effect."""
    refused: set[Instance] = set()
    for _ in range(rounds):
        tell("causes chosen", len(found.effects))
        room = limits.most - len(found.effects)
        fit = found.judged
        groups = screen(rows, fit, fit.r[:, None])
        if room <= 0 or named_evidence(groups)[0] <= limits.threshold:
            break
        had = refused | {fitted.instance for fitted in found.effects}
        fresh = [i for i in _best(rows, fit, groups)[:room] if i not in had]
        if not fresh:
            break
        instances = (*(fitted.instance for fitted in found.effects), *fresh)
        grown = fit_jointly(problem, found.cell, rows, instances, found.effects)
        kept = _still_needed(grown)
        if len(kept) < len(instances):
            refused |= set(instances) - set(kept)
            grown = fit_jointly(problem, grown.cell, rows, kept, grown.effects)
        if {fitted.instance for fitted in grown.effects} == {f.instance for f in found.effects}:
            break
        found = grown
    return found


def _still_needed(found: JointFit) -> tuple[Instance, ...]:
    """Effects that are likelier than nothing when judged given all the others."""
    evidence = found.evidence_of_effects()
    return tuple(
        fitted.instance
        for fitted, strength in zip(found.effects, evidence, strict=True)
        if strength > 0.0
    )


def _best(rows: Circumstances, fit: Linearised, groups: list[Group]) -> list[Instance]:
    """The best candidate, and where the evidence is plentiful others that are unlike it."""
    strength = [log_sum_exp(group.weighted[:, 0]) for group in groups]
    order = np.argsort(strength)[::-1]
    top = strength[order[0]]
    chosen: list[Instance] = []
    directions: list[Float[Array, "scalar k"]] = []
    for index in order:
        if chosen and (top < _CERTAIN or strength[index] < _ROUND_SHARE * top):
            break
        group = groups[index]
        instance = refine(rows, fit, group, int(np.argmax(group.weighted[:, 0])))
        X = fit.columns(EFFECTS[instance.effect].moves(rows, instance))
        X = X - fit.basis @ (fit.basis.T @ X)
        direction, _ = np.linalg.qr(X)
        alike = [np.linalg.norm(direction.T @ other, 2) for other in directions]
        if not alike or max(alike) < _ALIKE:
            chosen.append(instance)
            directions.append(direction)
    return chosen

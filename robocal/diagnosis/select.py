"""Several effects at once: forward with a joint fit after each, and a backward look at every one.

One-step naming fails when small other effects stand behind the main one; selecting step by step and
judging each effect again, given all the others, repairs it.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Instance
from robocal.diagnosis.effects.gear_harmonic import GearHarmonic
from robocal.diagnosis.evidence import log_bayes_factor, log_sum_exp
from robocal.diagnosis.joint_fit import JointFit, fit_jointly
from robocal.diagnosis.linearised import Linearised
from robocal.diagnosis.screen import Group, score_orders, screen, total_evidence
from robocal.identification.cell_model import CellModel
from robocal.identification.strategy import Problem

_ALIKE = 0.3
"""Candidates of one round must be less alike than this (cosine after projection); [1]"""
_ROUND_SHARE = 0.05
"""Candidates of one round need this share of the best one's evidence; [1]"""
_CERTAIN = 30.0
"""Only rounds with this much evidence take several candidates at once; [1]"""


@dataclass(frozen=True)
class Limits:
    """When to stop."""

    threshold: float
    """Total evidence below which nothing more is named."""
    most: int
    """Effects at most."""


def select_effects(
    problem: Problem, start: CellModel, rows: Circumstances, limits: Limits
) -> JointFit:
    """The effects that the rows speak for, fitted together with the geometry."""
    found = fit_jointly(problem, start, rows, ())
    refused: set[Instance] = set()
    while len(found.effects) < limits.most:
        fit = found.judged
        groups = screen(rows, fit, fit.r[:, None])
        if total_evidence(groups)[0] <= limits.threshold:
            break
        room = limits.most - len(found.effects)
        fresh = [i for i in _best(rows, fit, groups)[:room] if i not in refused]
        if not fresh:
            break
        instances = (*(fitted.instance for fitted in found.effects), *fresh)
        grown = fit_jointly(problem, found.cell, rows, instances, found.effects)
        kept = _still_needed(grown, limits.threshold)
        if len(kept) < len(instances):
            refused |= set(instances) - set(kept)
            grown = fit_jointly(problem, grown.cell, rows, kept, grown.effects)
        if {fitted.instance for fitted in grown.effects} == {f.instance for f in found.effects}:
            break
        found = grown
    return found


def without(found: JointFit, position: int) -> Linearised:
    """The linear fit as it would stand without one effect, the rest refitted."""
    fit = found.judged
    first = sum(len(f.instance.coefficients) for f in found.effects[:position])
    part = slice(first, first + len(found.effects[position].instance.coefficients))
    X = fit.more[:, part]
    kept = np.ones(fit.more.shape[1], dtype=bool)
    kept[part] = False
    rest = replace(fit, more=fit.more[:, kept], more_precision=fit.more_precision[kept])
    r = fit.r + X @ found.effects[position].values
    return replace(rest, r=r - rest.basis @ (rest.basis.T @ r))


def _still_needed(found: JointFit, threshold: float) -> tuple[Instance, ...]:
    """Effects that stand up when judged given all the others."""
    evidence = found.evidence_of_effects()
    return tuple(
        fitted.instance
        for fitted, strength in zip(found.effects, evidence, strict=True)
        if strength > max(threshold, 0.0)
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


def refine(rows: Circumstances, fit: Linearised, group: Group, best: int) -> Instance:
    """The best candidate of a group, its order refined between the points of the grid."""
    instance = group.instances[best]
    effect = EFFECTS[instance.effect]
    if not isinstance(effect, GearHarmonic) or len(group.instances) < 3 or instance.joint is None:
        return instance
    orders = np.array([candidate.argument("order") for candidate in group.instances])
    width = float(orders[1] - orders[0])
    fine = instance.argument("order") + np.linspace(-width, width, 41)
    fine = fine[fine > 0.25 * orders[0]]
    M, b = score_orders(rows, fit, fit.r[:, None], instance.joint, fine)
    evidence = log_bayes_factor(M[:, None], b, instance.prior_std)[:, 0]
    return effect.at(instance.joint, _plain(float(fine[int(np.argmax(evidence))]), fine, evidence))


def _plain(order: float, fine: Float[Array, "order"], evidence: Float[Array, "order"]) -> float:
    """A whole number where the data cannot tell it from the best order."""
    whole = float(round(order))
    if whole < fine[0] or whole > fine[-1]:
        return order
    there = float(np.interp(whole, fine, evidence))
    return whole if evidence.max() - there < 2.0 else order

"""The best order of a gear between those of the grid."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Instance
from robocal.diagnosis.effects.gear_harmonic import GearHarmonic
from robocal.diagnosis.evidence import log_bayes_factor
from robocal.diagnosis.group import Group
from robocal.diagnosis.linearised import Linearised
from robocal.diagnosis.order_sweep import LOWEST_ORDER, score_orders

_SEARCHED = 3
"""A group of harmonics with so many candidates is a grid of orders; [1]"""


def refine(rows: Circumstances, fit: Linearised, group: Group, best: int) -> Instance:
    """The best candidate of a group, its order refined between the points of the grid."""
    instance = group.candidate(best)
    effect = EFFECTS[instance.effect]
    if not isinstance(effect, GearHarmonic) or len(group.b) < _SEARCHED or instance.joint is None:
        return instance
    first, second = (group.candidate(position).argument("order") for position in (0, 1))
    width = second - first
    fine = instance.argument("order") + np.linspace(-width, width, 41)
    fine = fine[fine >= max(LOWEST_ORDER, first - 0.5 * width)]
    M, b = score_orders(rows, fit, instance.joint, fine)
    evidence = log_bayes_factor(M, b, instance.prior_std[None])
    return effect.at(instance.joint, _plain(float(fine[int(np.argmax(evidence))]), fine, evidence))


def _plain(order: float, fine: Float[Array, "order"], evidence: Float[Array, "order"]) -> float:
    """A whole number where the data cannot tell it from the best order."""
    whole = float(round(order))
    if whole < fine[0] or whole > fine[-1]:
        return order
    there = float(np.interp(whole, fine, evidence))
    return whole if evidence.max() - there < 2.0 else order

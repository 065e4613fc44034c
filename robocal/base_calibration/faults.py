r"""Stage faults and slipped touches, found in what the registration leaves over, and named.

Each candidate is a pattern Z in the whitened residuals. With the registration's own unknowns
projected out, the evidence for it against nothing is

.. math::
   \log B = \tfrac12 r^T Z (Z^T Z + \tau^{-2})^{-1} Z^T r - \tfrac12 \log|1 + \tau^2 Z^T Z|,

with its physical size tau as prior. Nothing has the prior probability `_NONE`; the rest is shared
evenly by the kinds of fault, and a slip's share by the touches.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.base_calibration.corrections import CORRECTIONS, N_CORRECTIONS
from robocal.base_calibration.solution import Solution, solve
from robocal.base_calibration.stage import Stage
from robocal.base_calibration.touches import Touches

_NONE = 0.7
"""Prior probability that nothing is wrong; at 0.5 a sound stage was blamed 3 times in 100; [1]"""
_SLIP_STD = 1e-3
"""Typical slip of a needle in its cup, per axis [m]"""
_MOST = 3
"""Faults named at most, one after the other; [1]"""
_ALTERNATIVE = 0.05
"""Another explanation is mentioned from this probability on; [1]"""
_TOUCH_NAMED = 0.8
"""One touch is taken out only if it is the slipped one with this share of all slips; [1]"""
SLIPPED = "slipped_touch"


@dataclass(frozen=True)
class StageFault:
    """One fault that the touches show.

    Parameters
    ----------
    fault
        Name of a correction, or `slipped_touch`.
    probability
        Posterior probability that it, rather than nothing or another, explains the misclosures.
    lines
        Touches that slipped; several where they cannot be told apart; empty for a correction.
    remedied
        The correction was set free, or the touch taken out.
    confusable_with
        Other faults that remain possible, with their probability.
    """

    fault: str
    probability: float
    lines: tuple[int, ...]
    remedied: bool
    confusable_with: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Examination:
    """The registration after all faults that could be named were dealt with."""

    solution: Solution
    touches: Touches
    """Without those taken out."""
    stage: Stage
    """With wide priors for the faulty corrections."""
    faults: tuple[StageFault, ...]
    rejected: tuple[int, ...]
    """Lines of the touches taken out."""


def examine(touches: Touches, stage: Stage) -> Examination:
    """Register, and deal with one fault after the other until nothing is likelier than any."""
    solution = solve(touches, stage)
    suspects = np.ones(N_CORRECTIONS, dtype=bool)
    faults: list[StageFault] = []
    rejected: list[int] = []
    while len(faults) < _MOST:
        fault = _likeliest(solution, touches, suspects)
        if fault is None:
            break
        faults.append(fault)
        if not fault.remedied:
            break
        if fault.fault == SLIPPED:
            touches = touches.only(~np.isin(touches.lines, fault.lines))
            rejected.extend(fault.lines)
        else:
            index = [correction.name for correction in CORRECTIONS].index(fault.fault)
            suspects[index] = False
            prior_std = stage.prior_std.copy()
            prior_std[index] = CORRECTIONS[index].fault_std
            stage = replace(stage, prior_std=prior_std)
        solution = solve(touches, stage)
    return Examination(solution, touches, stage, tuple(faults), tuple(rejected))


def _likeliest(
    solution: Solution, touches: Touches, suspects: Bool[Array, "correction"]
) -> StageFault | None:
    """The likeliest fault, or None where nothing is likelier."""
    evidence = _correction_evidence(solution)
    slips = _slip_evidence(solution, len(touches))
    share = (1.0 - _NONE) / (suspects.sum() + 1)
    log_odds = {
        CORRECTIONS[k].name: float(evidence[k] + np.log(share)) for k in np.flatnonzero(suspects)
    }
    log_odds[SLIPPED] = float(np.logaddexp.reduce(slips) - np.log(len(slips)) + np.log(share))
    log_total = np.logaddexp.reduce([*log_odds.values(), np.log(_NONE)])
    probability = {name: float(np.exp(odds - log_total)) for name, odds in log_odds.items()}
    if np.log(_NONE) >= np.logaddexp.reduce(list(log_odds.values())):
        return None
    name = max(probability, key=lambda fault: probability[fault])
    others = tuple(
        (other, p) for other, p in probability.items() if other != name and p >= _ALTERNATIVE
    )
    if name != SLIPPED:
        return StageFault(name, probability[name], (), remedied=True, confusable_with=others)
    each = np.exp(slips - np.logaddexp.reduce(slips))
    # A touch without which there would be no answer at all stays.
    enough = touches.only(each < each.max()).two_by_each
    named = enough and each.max() >= _TOUCH_NAMED
    chosen = each == each.max() if named else each >= _ALTERNATIVE
    lines = tuple(int(line) for line in touches.lines[chosen])
    return StageFault(SLIPPED, probability[name], lines, bool(named), others)


def visible_columns(solution: Solution) -> Float[Array, "row correction"]:
    """What one unit of each correction leaves in the residuals after the fit took its share."""
    columns = solution.equations.J[:, -N_CORRECTIONS:].copy()
    # The prior's own row is no part of what a fault does to the touches.
    columns[solution.equations.n_coordinates :] = 0.0
    return np.asarray(columns - solution.equations.J @ (solution.inverse @ columns))


def _correction_evidence(solution: Solution) -> Float[Array, "correction"]:
    """Logarithm of the Bayes factor of each correction's fault against nothing."""
    Z = visible_columns(solution)
    tau = np.array([correction.fault_std for correction in CORRECTIONS])
    strength = tau**2 * (Z * Z).sum(axis=0)
    along = tau * (Z.T @ solution.equations.residual)
    return np.asarray(0.5 * along**2 / (1.0 + strength) - 0.5 * np.log1p(strength))


def _slip_evidence(solution: Solution, n_touches: int) -> Float[Array, "touch"]:
    """Logarithm of the Bayes factor of each touch's slip against nothing."""
    n = solution.equations.n_coordinates
    Z = np.zeros((len(solution.equations.residual), n))
    Z[:n] = np.linalg.solve(solution.equations.touch_root, np.eye(n) * _SLIP_STD)
    Z -= solution.equations.J @ (solution.inverse @ Z)
    patterns = Z.reshape(-1, n_touches, 3)
    strength = np.eye(3) + np.einsum("rti,rtj->tij", patterns, patterns)
    along = np.einsum("rti,r->ti", patterns, solution.equations.residual)
    fitted = np.linalg.solve(strength, along[:, :, None])[:, :, 0]
    return np.asarray(0.5 * (along * fitted).sum(axis=1) - 0.5 * np.linalg.slogdet(strength)[1])

"""How sure a name is: posterior over all causes for the place of one effect, given the others."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Instance
from robocal.diagnosis.evidence import log_sum_exp
from robocal.diagnosis.group import Group
from robocal.diagnosis.linearised import Linearised
from robocal.diagnosis.refine import refine
from robocal.diagnosis.screen import evidence_by_name, screen
from robocal.diagnosis.unlisted import Block, Unlisted, weigh

P_NONE = 0.5
"""Prior probability that nothing more acts; [1]"""
STATED = 0.95
"""Probability of the stated set of causes; [1]"""
UNLISTED = 0.5
"""Probability from which a cause counts as one outside the catalogue; [1]"""
_LEAST = 0.005
"""Causes less probable than this are not listed; [1]"""


@dataclass(frozen=True)
class Cause:
    """One cause and its probability in the place of an effect."""

    instance: Instance
    probability: float

    @property
    def key(self) -> tuple[str, int | None]:
        """What it is called: effect and joint."""
        return self.instance.effect, self.instance.joint


@dataclass(frozen=True)
class Naming:
    """What may stand in the place of one effect of the model."""

    causes: tuple[Cause, ...]
    """Most probable first; together they hold at least `STATED`."""
    none: float
    """Probability that nothing acts there."""
    unlisted: float = 0.0
    """Probability of a cause outside the catalogue."""
    moved_by: Unlisted | None = None
    """What that cause most probably goes with."""

    @property
    def may_be_nothing(self) -> bool:
        """Whether "nothing" cannot be left out of what holds `STATED` of the probability."""
        return self.none > 1.0 - STATED

    @property
    def stated(self) -> tuple[Cause, ...]:
        """The smallest set that holds `STATED` of the probability."""
        total, kept = 0.0, []
        for cause in self.causes:
            kept.append(cause)
            total += cause.probability
            if total >= STATED:
                break
        return tuple(kept)


def itself_or_nothing(instance: Instance, evidence: float) -> Naming:
    """For the smallest of many effects: weighed against nothing, not against the catalogue."""
    odds = np.log(P_NONE / (1.0 - P_NONE)) - evidence
    none = float(1.0 / (1.0 + np.exp(-np.clip(odds, -700.0, 700.0))))
    return Naming((Cause(instance, 1.0 - none),), none)


def name_cause(rows: Circumstances, rest: Linearised, beside: Sequence[Block] = ()) -> Naming:
    """Posterior over the catalogue for the place of one effect.

    Parameters
    ----------
    rows
        Circumstances of the rows of `rest`.
    rest
        The fit as it stands without the effect (`JointFit.without`).
    beside
        What causes outside the catalogue may look like, with the columns of `rest`.
    """
    groups = screen(rows, rest, rest.r[:, None])
    best: dict[tuple[str, int | None], tuple[float, Group, int]] = {}
    for group in groups:
        weighted = group.weighted[:, 0]
        key, top = (group.effect, group.joint), int(np.argmax(weighted))
        if key not in best or weighted[top] > best[key][0]:
            best[key] = (float(weighted[top]), group, top)
    logs = {key: float(evidence[0]) for key, evidence in evidence_by_name(groups).items()}
    odds = np.log((1.0 - P_NONE) / P_NONE)
    outside = weigh(beside, rest)
    everything = np.array([
        0.0,
        *(value + odds for value in logs.values()),
        *(one.log_bf + odds for one in outside),
    ])
    total = log_sum_exp(everything)
    probabilities = {key: float(np.exp(value + odds - total)) for key, value in logs.items()}
    least = min(_LEAST, max(probabilities.values()))
    causes = [
        Cause(refine(rows, rest, *best[key][1:]), probability)
        for key, probability in probabilities.items()
        if probability >= least
    ]
    causes.sort(key=lambda cause: -cause.probability)
    unlisted = sum(float(np.exp(one.log_bf + odds - total)) for one in outside)
    return Naming(tuple(causes), float(np.exp(-total)), unlisted, outside[0] if outside else None)

"""How sure a name is: posterior over all causes for the place of one effect, given the others."""

from dataclasses import dataclass

import numpy as np

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Instance
from robocal.diagnosis.evidence import log_sum_exp
from robocal.diagnosis.linearised import Linearised
from robocal.diagnosis.screen import screen

P_NONE = 0.5
"""Prior probability that nothing more acts; [1]"""
STATED = 0.95
"""Probability of the stated set of causes; [1]"""
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


def name_cause(rows: Circumstances, rest: Linearised) -> Naming:
    """Posterior over the catalogue for the place of one effect.

    Parameters
    ----------
    rows
        Circumstances of the rows of `rest`.
    rest
        The fit as it stands without the effect (`select.without`).
    """
    groups = screen(rows, rest, rest.r[:, None])
    n_families = len({group.effect for group in groups})
    strengths: dict[tuple[str, int | None], list[float]] = {}
    best: dict[tuple[str, int | None], tuple[float, Instance]] = {}
    for group in groups:
        weighted = group.weighted[:, 0]
        key = (group.effect, group.joint)
        strengths.setdefault(key, []).append(log_sum_exp(weighted) - np.log(n_families))
        top = int(np.argmax(weighted))
        if key not in best or weighted[top] > best[key][0]:
            best[key] = (float(weighted[top]), group.candidate(top))
    logs = {key: log_sum_exp(np.array(values)) for key, values in strengths.items()}
    odds = np.log((1.0 - P_NONE) / P_NONE)
    everything = np.array([0.0, *(value + odds for value in logs.values())])
    total = log_sum_exp(everything)
    causes = [
        Cause(best[key][1], float(np.exp(value + odds - total))) for key, value in logs.items()
    ]
    causes = [cause for cause in causes if cause.probability >= _LEAST]
    causes.sort(key=lambda cause: -cause.probability)
    return Naming(tuple(causes), float(np.exp(-total)))

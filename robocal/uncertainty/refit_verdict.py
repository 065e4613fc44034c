r"""Whether simulated campaigns, fitted again, bear out the standard uncertainties by linearisation.

The standard deviation of n refits scatters by :math:`1/\sqrt{2(n - 1)}` of itself and their mean by
:math:`1/\sqrt n` of it; a difference counts where chance would make the largest of all parameters
exceed it in fewer than `DOUBT` of the cases (Bonferroni).
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from robocal.identification.result import Identification
from robocal.uncertainty.evaluation import Evaluation, RefitCheck
from robocal.uncertainty.repeats import DOUBT


@dataclass(frozen=True)
class RefitVerdict:
    """What the refits say of the linearisation."""

    agree: bool
    sentence: str
    """For people."""


def judge_refits(evaluation: Evaluation, refits: RefitCheck) -> RefitVerdict:
    """Hold standard deviation and mean of the refits against the stated standard uncertainties.

    Only of identified parameters; of redundant ones each fit may end elsewhere.
    """
    kept = _identified(evaluation.result, evaluation)
    stated = evaluation.parameters.std[kept]
    ratio = refits.std[kept] / stated
    shift = np.abs(refits.bias[kept]) / stated
    limit = float(ndtri(1.0 - DOUBT / (4.0 * len(kept))))
    of_ratio = limit / np.sqrt(2.0 * (refits.count - 1))
    of_shift = limit / np.sqrt(refits.count)
    first = (
        f"{refits.count} simulated campaigns fitted again: standard deviations of the identified "
        f"parameters are {ratio.min():.2f} to {ratio.max():.2f} of those stated"
    )
    if refits.n_unsettled:
        first += f"; {refits.n_unsettled} did not settle"
    reasons = []
    names = evaluation.result.cell.names
    if np.abs(ratio - 1.0).max() > of_ratio:
        worst = int(np.abs(ratio - 1.0).argmax())
        reasons.append(f"{names[kept[worst]]} scatters {ratio[worst]:.2f} times as stated")
    if shift.max() > of_shift:
        worst = int(shift.argmax())
        reasons.append(f"{names[kept[worst]]} is off by {shift[worst]:.2f} of its u on average")
    if reasons:
        told = " and ".join(reasons)
        return RefitVerdict(
            agree=False,
            sentence=f"{first}: they disagree with the linearisation beyond chance ({told}); "
            "use the intervals of the refits",
        )
    return RefitVerdict(
        agree=True,
        sentence=f"{first}: no more than chance explains (up to {of_ratio:.0%}), so linearising is "
        "good here",
    )


def _identified(result: Identification, evaluation: Evaluation) -> list[int]:
    stated = evaluation.parameters.std
    return [
        int(k) for k in result.free if result.cell.names[k] not in result.reasons and stated[k] > 0
    ]

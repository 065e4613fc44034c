"""Whether the stated intervals may be believed: what the data say against their assumptions."""

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from robocal.uncertainty.budget import ReadingsBy
from robocal.uncertainty.fitted_rows import FittedRows
from robocal.uncertainty.repeats import DOUBT, Repeats, Scatter


@dataclass(frozen=True)
class Verdict:
    """`hold` is None where nothing is left over to judge by."""

    hold: bool | None
    reasons: tuple[str, ...]
    """What speaks against the intervals, one sentence each."""

    @property
    def sentence(self) -> str:
        """For people."""
        if self.hold is None:
            return "whether the intervals hold cannot be judged: " + "; ".join(self.reasons)
        if self.hold:
            return "nothing in the data speaks against the intervals"
        return "the intervals do not hold: " + "; ".join(self.reasons)


def judge_intervals(fit: FittedRows, repeats: Repeats) -> Verdict:
    """Hold the assumptions (noise as stated, nothing unmodelled) against residuals and repeats."""
    adequacy = fit.result.adequacy
    reasons = []
    if not fit.result.converged:
        reasons.append("the iteration did not converge")
    if fit.bundle.budget.readings is ReadingsBy.repeats:
        reasons += _against_own_scatter(fit, repeats)
    else:
        if adequacy.nu > 0 and not adequacy.adequate:
            reasons.append(adequacy.sentence)
        for kind, scatter, unit in (
            ("positions", repeats.position, "mm"),
            ("orientations", repeats.orientation, "mrad"),
        ):
            if scatter is not None and scatter.contradicts:
                reasons.append(_against_declaration(kind, scatter, unit))
    if reasons:
        return Verdict(hold=False, reasons=tuple(reasons))
    if not adequacy.judged:
        return Verdict(hold=None, reasons=(adequacy.sentence,))
    return Verdict(hold=True, reasons=())


def _against_own_scatter(fit: FittedRows, repeats: Repeats) -> list[str]:
    """The F test of lack of fit: residuals against the repeats' scatter, whatever was declared."""
    adequacy = fit.result.adequacy
    counted = [
        (scatter, int(np.count_nonzero(weight)))
        for scatter, weight in (
            (repeats.position, fit.rows.position_weight),
            (repeats.orientation, fit.rows.orientation_weight),
        )
        if scatter is not None
    ]
    rows = sum(count for _, count in counted)
    expected = sum(scatter.ratio * count for scatter, count in counted) / rows
    nu = min(scatter.nu for scatter, _ in counted)
    ratio = adequacy.reduced_chi_square / expected
    if adequacy.nu <= 0 or fdtrc(adequacy.nu, nu, ratio) >= DOUBT:
        return []
    return [
        f"the residuals are {ratio**0.5:.2f} times the scatter of the repeats: the model leaves "
        "something out; run robocal diagnose before the parameters are used"
    ]


def _against_declaration(kind: str, scatter: Scatter, unit: str) -> str:
    times = scatter.ratio**0.5
    return (
        f"repeats of the {kind} scatter by {scatter.std * 1e3:.4g} {unit}, {times:.2f} times what "
        "campaign.yaml states of instrument and robot; correct the statement there, or have "
        "budget.readings say repeats"
    )

"""Whether the residuals are as large as the declared noise says: the reduced chi-square test."""

import math
from dataclasses import dataclass

from scipy.special import gammaincinv

BAND = 0.99
"""Probability of an adequate model to be called so; [1]"""
LEAST_NU = 10.0
"""Degrees of freedom below which a value inside the band says nothing: at ten the band still holds
residuals of 0.46 to 1.6 times the noise; [1]"""


@dataclass(frozen=True)
class Adequacy:
    """Reduced chi-square of a fit against the declared noise."""

    reduced_chi_square: float
    nu: float
    """Statistical degrees of freedom: measured scalars less what the fit took out of them."""
    low: float
    high: float
    """Ends of the band that holds an adequate model's value with probability `BAND`."""
    scalars_per_pose: float
    """What one more pose would add to `nu`; [1]"""

    @property
    def adequate(self) -> bool:
        """Whether the value lies in the band."""
        return self.low <= self.reduced_chi_square <= self.high

    @property
    def judged(self) -> bool:
        """Whether enough is left over to judge by: hardly anything tells only what is far off."""
        return self.nu > 0 and (self.nu >= LEAST_NU or not self.adequate)

    @property
    def leaves_noise_alone(self) -> bool:
        """Whether nothing beyond the declared noise is left, however large that was declared."""
        return self.reduced_chi_square <= self.high

    @property
    def is_too_quiet(self) -> bool:
        """Whether less is left than the declared noise."""
        return self.reduced_chi_square < self.low

    @property
    def sentence(self) -> str:
        """What it means, for people."""
        if not self.judged:
            return self.nothing_to_judge_by
        value = f"reduced chi-square {self.reduced_chi_square:.3g}"
        band = f"[{self.low:.3g}, {self.high:.3g}]"
        if self.adequate:
            return f"{value}, inside its 99 % band {band}: the residuals are the declared noise"
        if self.reduced_chi_square > self.high:
            return (
                f"{value}, above its 99 % band {band}: the model leaves more than the declared "
                "noise; run robocal diagnose before the parameters are used"
            )
        return f"{self.quiet_sentence}, and run robocal diagnose"

    @property
    def quiet_sentence(self) -> str:
        """What residuals below the band mean, for people."""
        return (
            f"reduced chi-square {self.reduced_chi_square:.3g}, below its 99 % band "
            f"[{self.low:.3g}, {self.high:.3g}]: the declared noise is too large, so the stated "
            "uncertainties are too; state the noise as the instrument's certificate has it"
        )

    @property
    def nothing_to_judge_by(self) -> str:
        """How little is left over, and how many poses more it takes, for people."""
        left = (
            "no measured number is" if self.nu <= 0 else f"only {self.nu:.2g} measured numbers are"
        )
        missing = math.ceil((LEAST_NU - self.nu) / self.scalars_per_pose)
        poses = "one more pose" if missing == 1 else f"{missing} more poses"
        return (
            f"{left} left over to judge the model by, so nothing says whether it is right; "
            f"measure at least {poses} besides those held out"
        )


def judge(chi_square: float, nu: float, scalars_per_pose: float = 3.0) -> Adequacy:
    """Adequacy of a fit with this sum of squared whitened residuals."""
    if nu <= 0:
        return Adequacy(float("nan"), nu, 0.0, float("inf"), scalars_per_pose)
    tail = (1.0 - BAND) / 2.0
    low, high = (2.0 * float(gammaincinv(nu / 2.0, p)) / nu for p in (tail, 1.0 - tail))
    return Adequacy(chi_square / nu, nu, low, high, scalars_per_pose)

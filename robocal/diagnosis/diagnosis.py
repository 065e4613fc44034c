"""What a diagnosis found."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.calibrated import CalibratedRobot
from robocal.data_faults.slip import Slip
from robocal.diagnosis.causes import UNLISTED, Naming
from robocal.diagnosis.covariates import Dependence
from robocal.diagnosis.extended import FittedEffect
from robocal.diagnosis.gain import Gain
from robocal.diagnosis.pure_error import PureError
from robocal.formats.bundle import RejectedRow
from robocal.identification.adequacy import LEAST_NU, Adequacy


class Verdict(StrEnum):
    """What the data say of the model."""

    model_adequate = "model_adequate"
    explained = "explained"
    partly_explained = "partly_explained"
    unknown_cause = "unknown_cause"


@dataclass(frozen=True)
class NamedEffect:
    """One effect that was put into the model."""

    fitted: FittedEffect
    naming: Naming
    explained_fraction: float
    """Share of the structure beyond noise that goes when it enters; [1]"""
    gain: Gain
    """On rows that chose nothing, this effect alone taken out of the final model."""
    blocked_gain: Gain
    """By blocked folds of the rows that chose it; of residuals over the noise."""
    form_corrections: tuple[FittedEffect, ...] = ()
    """Small effects that resemble it: they mend its form and are no causes of their own."""

    @property
    def in_sample_only(self) -> bool:
        """Whether the blocked gain may be nothing."""
        return self.blocked_gain.ci95[0] <= 0.0

    @property
    def goes_with(self) -> str | None:
        """The covariate of a cause outside the catalogue, where that is the most probable one."""
        naming = self.naming
        outside = naming.unlisted > UNLISTED and naming.moved_by is not None
        return naming.moved_by.covariate if outside and naming.moved_by else None

    @property
    def probability(self) -> float:
        """Of the named effect and joint."""
        key = (self.fitted.instance.effect, self.fitted.instance.joint)
        return sum(c.probability for c in self.naming.causes if c.key == key)


@dataclass(frozen=True)
class RowResiduals:
    """Distances before and after, row by row, for pictures [m]."""

    lines: Array
    held_out: Array
    before: Float[Array, "row"]
    after: Float[Array, "row"]


@dataclass(frozen=True)
class NextPoses:
    """Poses that would best split the leading causes."""

    q: Float[Array, "pose joint"]
    approach: Float[Array, "pose joint"]
    payload: Float[Array, "pose"]
    """[kg]; NaN where it does not matter or was never changed."""
    between: tuple[str, str] | None
    """The two causes they are chosen for; None where nothing is ambiguous."""
    words: tuple[str, ...]
    """What else would split them."""


@dataclass(frozen=True)
class Diagnosis:
    """The verdict, its evidence, and the extended model."""

    verdict: Verdict
    geometry_adequacy: Adequacy
    """Of the geometric model alone."""
    lack_of_fit_p: float
    pure_error: PureError | None
    adequacy: Adequacy
    """Of the extended model."""
    effects: tuple[NamedEffect, ...]
    """Most important first."""
    unusable: tuple[RejectedRow, ...]
    """Rows that no fit could use."""
    outliers: tuple[RejectedRow, ...]
    depends_on: tuple[Dependence, ...]
    """Covariates that the remaining residual depends on."""
    gain: Gain
    noise_floor: float
    """RMS distance that noise alone leaves on the rows of `gain` [m]."""
    next_poses: NextPoses
    residuals: RowResiduals
    calibrated: CalibratedRobot
    bundle_sha256: str
    hidden: tuple[str, ...]
    """Effects that these data cannot show, each with what would."""
    slips: tuple[Slip, ...] = ()
    """Slips of the data that were mended before anything else."""
    suspect: tuple[RejectedRow, ...] = ()
    """Rows held out that the model does not predict."""

    @property
    def too_few(self) -> bool:
        """Whether geometry leaves too few numbers over to judge causes by; none is named then."""
        return self.geometry_adequacy.nu < LEAST_NU

    @property
    def only_noise_is_larger(self) -> bool:
        """Whether repeats contradict the declared noise, and nothing contradicts the model."""
        unknown = self.verdict is Verdict.unknown_cause and not self.depends_on
        return unknown and self.pure_error is not None and self.pure_error.is_all_that_is_left

    @property
    def over_noise_floor(self) -> float:
        """RMS after, over the noise floor."""
        return self.gain.after / self.noise_floor if self.noise_floor > 0 else float(np.inf)

"""Candidates of one effect and joint with their scores: at most one of them is true."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.effect import Instance
from robocal.diagnosis.evidence import chi_square


@dataclass(frozen=True)
class Group:
    """Candidates of one effect and joint.

    `M` and `b` are stacks over the candidates; `b` has one more axis where several residuals were
    scored together.
    """

    effect: str
    joint: int | None
    candidate: Callable[[int], Instance]
    """The candidate at a position; thousands are searched, few are looked at."""
    prior_std: Float[Array, "candidate k"]
    log_prior: Float[Array, "candidate"]
    """Log of each candidate's share of the effect's prior."""
    M: Float[Array, "candidate k k"]
    b: Float[Array, "candidate residual k"]
    share: float = 1.0
    """Prior weight of the joint among those of the effect; [1]"""

    @property
    def log_bf(self) -> Float[Array, "candidate residual"]:
        """Log Bayes factors against nothing more."""
        # One inverse a candidate serves all residuals.
        scaled = self.M * self.prior_std[:, :, None] * self.prior_std[:, None, :]
        inner = np.eye(self.M.shape[-1]) + scaled
        score = self.b * self.prior_std[:, None]
        fit = ((score @ np.linalg.inv(inner)) * score).sum(axis=-1)
        return np.asarray(0.5 * (fit - np.linalg.slogdet(inner)[1][:, None]))

    @property
    def chi_square(self) -> Float[Array, "candidate residual"]:
        """Score statistics."""
        return chi_square(self.M[:, None], self.b)

    @cached_property
    def weighted(self) -> Float[Array, "candidate residual"]:
        """Log Bayes factors with the candidates' priors."""
        return np.asarray(self.log_bf + self.log_prior[:, None])


def listed(instances: list[Instance]) -> Callable[[int], Instance]:
    """Candidates from a list."""
    return instances.__getitem__

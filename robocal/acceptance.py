"""Whether a verification lets a model be called verified: independence and a stated criterion."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.verification import PoseAccuracy

NEAR_POSE = np.deg2rad(1.0)
"""A target all of whose joints are as near to a fitted pose was seen by the fit [rad or m]"""


@dataclass(frozen=True)
class Criterion:
    """What the compensated robot must reach; stated before anything is measured. Lengths [m]."""

    AP_mean: float
    """Largest mean of the pose accuracies AP_p."""
    AP_max: float
    """Largest single AP_p."""
    poses: int
    """Fewest poses on which it may be judged."""


@dataclass(frozen=True)
class Verdict:
    """What a verification showed."""

    passed: bool
    reasons: tuple[str, ...]
    """One sentence for each thing that failed; empty where all passed."""


def fitted_targets(
    targets: Float[Array, "target joint"], fitted: Float[Array, "row joint"]
) -> list[int]:
    """Numbers of the targets at whose joints the fit had a row."""
    distance = np.abs(targets[:, None, :] - fitted[None, :, :]).max(axis=2)
    return [int(k) for k in np.flatnonzero((distance < NEAR_POSE).any(axis=1))]


def judge(
    AP: Float[Array, "target"],
    before: PoseAccuracy,
    after: PoseAccuracy,
    seen_by_fit: list[int],
    criterion: Criterion,
) -> Verdict:
    """Whether the model counts as verified.

    Parameters
    ----------
    AP
        Pose accuracies of the compensated robot [m].
    before, after
        Accuracy over all visits with nominal and with compensated joints.
    seen_by_fit
        Targets that are not independent of the fit.
    criterion
        As stated for this campaign.
    """
    reasons = []
    if seen_by_fit:
        reasons.append(
            f"{len(seen_by_fit)} of {len(AP)} targets lie at poses that the fit has seen, "
            "so they prove nothing; verify on other poses."
        )
    if len(AP) < criterion.poses:
        reasons.append(f"Only {len(AP)} poses were verified, the criterion asks {criterion.poses}.")
    for name, found, most in (
        ("mean", AP.mean(), criterion.AP_mean),
        ("largest", AP.max(), criterion.AP_max),
    ):
        if found > most:
            reasons.append(
                f"The {name} pose accuracy AP_p is {found * 1e3:.3f} mm, the criterion allows "
                f"{most * 1e3:g} mm."
            )
    if after.position_mean >= before.position_mean:
        reasons.append(
            f"Compensated joints miss by {after.position_mean * 1e3:.3f} mm on average and "
            f"nominal ones by {before.position_mean * 1e3:.3f} mm: there is no gain."
        )
    return Verdict(not reasons, tuple(reasons))

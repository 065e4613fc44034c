"""What a straight-line estimator would find in each campaign: a control variate for coverage.

Least squares with priors, linearised at the nominal robot by differences of elementary matrices,
moves by a known matrix times the errors that were drawn. How often its errors stay within a stated
interval is known exactly, so the share of campaigns is corrected by how often they did in this
sample: what is left of the sampling error is where the true estimator differs from the straight
line. The correction has mean zero whatever robocal does, so wrong intervals show as before.

References
----------
.. [1] P. Glasserman, *Monte Carlo Methods in Financial Engineering*, Springer, 2003, 4.1.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.special import ndtr

from tests.elementary_kinematics import Arm, frame

STEP = 1e-5
BALL_DRAWS = 200_000
"""Of a normal distribution of known covariance, for its probability in a ball: to 0.05 %"""


@dataclass(frozen=True)
class Shares:
    """Of the campaigns whose interval holds the truth, one an interval."""

    counted: np.ndarray
    """As they fell."""
    corrected: np.ndarray
    """Less the luck of the sample."""
    error: np.ndarray
    """Standard deviation of the corrected share."""


@dataclass(frozen=True)
class Inside:
    """Whether each interval of each campaign holds the truth: campaign, interval."""

    really: np.ndarray
    linear: np.ndarray
    expected: np.ndarray
    """Probability of `linear`."""

    def shares(self) -> Shares:
        """Regress the one on the other."""
        really, linear = self.really.astype(float), self.linear.astype(float)
        away = linear - linear.mean(axis=0)
        variance = (away**2).sum(axis=0)
        slope = (away * really).sum(axis=0) / np.where(variance > 0, variance, 1.0)
        left = really - slope * (linear - self.expected)
        error = left.std(axis=0, ddof=1) / np.sqrt(len(left))
        return Shares(really.mean(axis=0), left.mean(axis=0), error)


def joined(pieces: list[Inside], campaigns: int) -> Inside:
    """The first campaigns of all pieces."""
    return Inside(
        np.concatenate([piece.really for piece in pieces])[:campaigns],
        np.concatenate([piece.linear for piece in pieces])[:campaigns],
        pieces[0].expected,
    )


@dataclass(frozen=True)
class LinearEstimator:
    """Of one set of poses.

    Parameters
    ----------
    gain
        Moves of the free parameters by whitened errors: free, reading.
    hold
        Their moves by the deviation of the true parameters from the prior's mean: free, free.
    stated, real
        Covariance that the estimator states, and that of its errors.
    J_new
        Position of the target at the new poses: pose, 3, free.
    """

    gain: np.ndarray
    hold: np.ndarray
    stated: np.ndarray
    real: np.ndarray
    J_new: np.ndarray

    def inside(self, errors: np.ndarray, deviation: np.ndarray, k: float, radius: np.ndarray):
        """Which intervals of each campaign hold the truth: parameters, coordinates, balls.

        Parameters
        ----------
        errors
            Whitened errors of the readings: campaign, reading.
        deviation
            Truth less the prior's mean: campaign, free.
        radius
            Stated, of every new pose [m].
        """
        away = errors @ self.gain.T + deviation @ self.hold.T
        moved = np.einsum("mif,cf->cmi", self.J_new, away)
        wide = np.sqrt(np.diag(self.stated))
        tool_wide = np.sqrt(np.einsum("mif,fg,mig->mi", self.J_new, self.stated, self.J_new))
        coordinates = np.abs(moved) <= k * tool_wide
        return (
            np.abs(away) <= k * wide,
            coordinates.reshape(len(moved), -1),
            np.linalg.norm(moved, axis=2) <= radius,
        )

    def expected(self, k: float, radius: np.ndarray):
        """The probability of each."""
        tool = self.J_new @ self.real @ np.swapaxes(self.J_new, 1, 2)
        stated = self.J_new @ self.stated @ np.swapaxes(self.J_new, 1, 2)
        ratio = np.sqrt(np.diag(self.stated) / np.diag(self.real))
        tool_ratio = np.sqrt(np.einsum("mii->mi", stated) / np.einsum("mii->mi", tool)).ravel()
        normal = np.random.default_rng(0).normal(size=(BALL_DRAWS, 3))
        balls = [
            (np.linalg.norm(normal @ np.linalg.cholesky(own).T, axis=1) <= r).mean()
            for own, r in zip(tool, radius, strict=True)
        ]
        return 2 * ndtr(k * ratio) - 1, 2 * ndtr(k * tool_ratio) - 1, np.array(balls)


def linear_estimator(
    nominal: Arm,
    q: np.ndarray,
    new_q: np.ndarray,
    free: np.ndarray,
    weight: np.ndarray,
    precision: np.ndarray,
    spread: np.ndarray,
) -> LinearEstimator:
    """Linearise at the nominal arm.

    Parameters
    ----------
    q, new_q
        Measured and new poses [rad or m].
    free
        Numbers of the free parameters: links row by row, base, tool.
    weight
        One over the standard deviation of every component that is read: pose, 3 or 6.
    precision
        Of the prior [1/m2, 1/rad2].
    spread
        Standard deviation of the true parameters about the prior's mean [m, rad].
    """
    J = _jacobian(nominal, q, free)[:, : weight.shape[1]] * weight[:, :, None]
    rows = J.reshape(-1, len(free))
    stated = np.linalg.inv(rows.T @ rows + np.diag(precision))
    gain = stated @ rows.T
    hold = -stated * precision
    real = gain @ gain.T + (hold * spread**2) @ hold.T
    return LinearEstimator(gain, hold, stated, real, _jacobian(nominal, new_q, free)[:, :3])


def _jacobian(nominal: Arm, q: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Position and rotation vector against the parameters: pose, 6, free."""
    columns = []
    for index in free:
        up, down = (_moved(nominal, index, sign * STEP).poses(q) for sign in (1.0, -1.0))
        turn = Rotation.from_matrix(up[:, :3, :3] @ np.swapaxes(down[:, :3, :3], 1, 2))
        columns.append(np.hstack([up[:, :3, 3] - down[:, :3, 3], turn.as_rotvec()]) / (2 * STEP))
    return np.stack(columns, axis=2)


def _moved(nominal: Arm, index: int, step: float) -> Arm:
    n = nominal.links.size
    moves = np.zeros(n + 12)
    moves[index] = step
    links = nominal.links + moves[:n].reshape(-1, 5)
    base, tool = nominal.base @ frame(moves[n : n + 6]), nominal.tool @ frame(moves[n + 6 :])
    return Arm(links, nominal.prismatic, nominal.limits, base, tool)

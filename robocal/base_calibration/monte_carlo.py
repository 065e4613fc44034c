"""Monte Carlo of the registration: all inputs drawn anew, all draws solved together."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.base_calibration.corrections import N_CORRECTIONS
from robocal.base_calibration.solution import Solution
from robocal.base_calibration.stage import Readings, Stage, cup_positions
from robocal.base_calibration.state import moved_frames
from robocal.base_calibration.touches import Touches
from robocal.frames import rotation_vector

DRAWS = 2_000
COVERAGE = 0.95
_ITERATIONS = 4
"""With the Jacobian held, each gains the ratio of noise to arm length, about 1e-4; [1]"""


@dataclass(frozen=True)
class RegistrationDraws:
    """Moves of the slave's frame about the estimate: shift [m], rotation vector [rad]."""

    moves: Float[Array, "draw 6"]

    @property
    def mean(self) -> Float[Array, "6"]:
        """Mean move; its distance from zero is the bias of second order."""
        return np.asarray(self.moves.mean(axis=0))

    @property
    def std(self) -> Float[Array, "6"]:
        """Standard uncertainties."""
        return np.asarray(self.moves.std(axis=0, ddof=1))

    @property
    def half_width(self) -> Float[Array, "6"]:
        """Half the shortest symmetric interval that holds `COVERAGE` of the draws."""
        return np.asarray(np.quantile(np.abs(self.moves), COVERAGE, axis=0))


def draw_registrations(
    solution: Solution, touches: Touches, stage: Stage, draws: int = DRAWS, seed: int = 1
) -> RegistrationDraws:
    """Propagate tips, readings, levels and priors through the registration.

    Directions that the touches leave open stay at the estimate.

    References
    ----------
    .. [1] JCGM 101:2008, 6.4 and 7.
    """
    rng = np.random.default_rng(seed)
    tips, readings = _drawn_touches(touches, stage, draws, rng)
    n = solution.equations.n_coordinates
    offset = rng.normal(size=(draws, len(solution.equations.residual) - n))
    x = np.zeros((draws, solution.state.size))
    for _ in range(_ITERATIONS):
        residual = _residuals(solution, touches, tips, readings, x)
        held = solution.equations.residual[n:] + x @ solution.equations.J[n:].T - offset
        x -= np.concatenate([residual, held], axis=1) @ solution.inverse.T
    slave = x[:, solution.state.slave_columns]
    turned = moved_frames(np.tile(np.eye(4), (draws, 1, 1)), slave)
    return RegistrationDraws(np.column_stack([slave[:, :3], rotation_vector(turned[:, :3, :3])]))


def _drawn_touches(
    touches: Touches, stage: Stage, draws: int, rng: np.random.Generator
) -> tuple[Float[Array, "draw touch 3"], Readings]:
    """Tips and readings with noise; readings that are one reading move together."""
    root = np.linalg.cholesky(touches.tip_covariance)
    noise = rng.normal(size=(draws, len(root))) @ root.T
    groups, kinds = touches.reading_groups()
    sigma = np.array([stage.sigma_slide, stage.sigma_angle, stage.sigma_rod])
    group_noise = rng.normal(size=(draws, len(kinds))) * sigma[kinds.astype(int)]
    each = np.where(groups >= 0, group_noise[:, groups], 0.0)
    readings = Readings(
        touches.readings.slide + each[:, :, 0],
        touches.readings.angle + each[:, :, 1],
        touches.readings.length + each[:, :, 2],
    )
    return touches.tips + noise.reshape(draws, -1, 3), readings


def _residuals(
    solution: Solution,
    touches: Touches,
    tips: Float[Array, "draw touch 3"],
    readings: Readings,
    x: Float[Array, "draw unknown"],
) -> Float[Array, "draw coordinate"]:
    """Whitened misclosures of every draw after the moves `x`."""
    state, draws = solution.state, len(x)
    n_frames = len(state.stages) + 1
    frames = np.tile(np.concatenate([state.stages, state.slave[None]]), (draws, 1, 1))
    moves = x[:, : 6 * n_frames].reshape(-1, 6)
    frames = moved_frames(frames, moves).reshape(draws, n_frames, 4, 4)
    stages, slave = frames[:, touches.placement], frames[:, -1]
    cups = cup_positions(
        readings,
        touches.on_rod,
        state.corrections + x[:, -N_CORRECTIONS:],
        stages[:, :, 2, :3],
        touches.rod_reference,
    )
    cups = np.einsum("dtij,dtj->dti", stages[..., :3, :3], cups) + stages[..., :3, 3]
    # Along the touching robot's own axes, as the equations are weighed.
    seen = np.einsum("dji,dtj->dti", slave[:, :3, :3], cups - slave[:, None, :3, 3])
    misclosure = tips - np.where(touches.by_slave[:, None], seen, cups)
    root = solution.equations.touch_root
    return np.asarray(np.linalg.solve(root, misclosure.reshape(draws, -1).T).T)

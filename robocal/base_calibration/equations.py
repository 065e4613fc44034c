r"""The weighted least squares of a registration: residuals, analytic Jacobian, weights.

For each touch the tip, carried into the master's base, less the cup, as the sensors place it:
:math:`f = T\,t - (O + R\,c)`. Its covariance holds the tip's and, through the stage's derivatives,
the readings'; where several touches share a reading or a robot's parameters it is not block
diagonal. Levelling and the corrections' priors add one row each.

A robot's rows are weighed along that robot's own axes. What the touches leave open (a turn of
everything about the line of the master's touches, a turn of the slave about the line of its own)
then changes no row at all, at any state; along fixed axes the misclosure itself would turn, and
look like knowledge of the open direction.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.base_calibration.corrections import N_CORRECTIONS
from robocal.base_calibration.stage import CupDerivatives, Stage, cup_derivatives, cup_positions
from robocal.base_calibration.state import State
from robocal.base_calibration.touches import Touches


@dataclass(frozen=True)
class Equations:
    """Whitened equations at one state: rows of touches, then of levels, then of priors."""

    residual: Float[Array, "row"]
    """Misclosure; the least-squares step is the x of `J x = -residual`."""
    J: Float[Array, "row unknown"]
    touch_root: Float[Array, "coordinate coordinate"]
    """Lower Cholesky factor of the misclosures' covariance along the robots' own axes [m]."""
    misclosure: Float[Array, "touch 3"]
    """Tip less cup in the master's base [m]."""

    @property
    def n_coordinates(self) -> int:
        """Rows that come from touches."""
        return len(self.touch_root)


def free_unknowns(state: State, stage: Stage) -> Bool[Array, "unknown"]:
    """Unknowns that may move: all frames, and corrections whose prior is not zero."""
    return np.concatenate([np.ones(state.size - N_CORRECTIONS, dtype=bool), stage.prior_std > 0])


@dataclass(frozen=True)
class TouchRows:
    """What each touch says by itself, not yet weighted, in the master's axes."""

    misclosure: Float[Array, "touch 3"]
    J: Float[Array, "touch 3 unknown"]
    by_reading: Float[Array, "touch 3 3"]
    """Move of the cup by slide, angle and length reading."""


def build_equations(state: State, touches: Touches, stage: Stage) -> Equations:
    """Residuals, Jacobian and weights at `state`."""
    rows = touch_rows(state, touches)
    own = np.where(touches.by_slave[:, None, None], state.slave[:3, :3].T, np.eye(3))
    root = np.linalg.cholesky(_covariance(touches, stage, own @ rows.by_reading))
    level, J_level = _level_rows(state, stage)
    prior, J_prior = _prior_rows(state, stage)
    misclosure = np.einsum("tij,tj->ti", own, rows.misclosure)
    J = own @ _with_turning_axes(state, touches, rows)
    raw = np.column_stack([misclosure.ravel(), J.reshape(-1, state.size)])
    whitened = np.linalg.solve(root, raw)
    return Equations(
        np.concatenate([whitened[:, 0], level, prior]),
        np.concatenate([whitened[:, 1:], J_level, J_prior]),
        root,
        rows.misclosure,
    )


def touch_rows(state: State, touches: Touches) -> TouchRows:
    """Misclosure of each touch and its derivatives."""
    frames = state.stages[touches.placement]
    rotation, up = frames[:, :3, :3], frames[:, 2, :3]
    cup = (touches.readings, touches.on_rod, state.corrections, up, touches.rod_reference)
    arms = np.einsum("tij,tj->ti", rotation, cup_positions(*cup))
    slave = touches.by_slave[:, None]
    turned = np.where(slave, touches.tips @ state.slave[:3, :3].T, 0.0)
    tips = np.where(slave, turned + state.slave[:3, 3], touches.tips)
    by = cup_derivatives(*cup)
    J = _touch_jacobian(state, touches, arms, turned, by)
    return TouchRows(tips - arms - frames[:, :3, 3], J, rotation @ by.readings)


def _with_turning_axes(
    state: State, touches: Touches, rows: TouchRows
) -> Float[Array, "touch 3 unknown"]:
    """Derivatives as seen along the slave's axes, which turn along: d(R' f) = R' (df - w x f)."""
    J = rows.J.copy()
    turn = slice(state.slave_columns.start + 3, state.slave_columns.stop)
    for touch in np.flatnonzero(touches.by_slave):
        J[touch, :, turn] += _cross(rows.misclosure[touch])
    return J


def _touch_jacobian(
    state: State,
    touches: Touches,
    arms: Float[Array, "touch 3"],
    turned_tips: Float[Array, "touch 3"],
    by: CupDerivatives,
) -> Float[Array, "touch 3 unknown"]:
    """Derivatives of the misclosures [m by m, rad or correction]."""
    rotation = state.stages[touches.placement][:, :3, :3]
    J = np.zeros((len(touches), 3, state.size))
    # A turn of the stage leaves gravity where it is, so the sag does not turn along:
    # d(up) = -R^T (turn x z).
    held = np.einsum("tij,tjk,tlk->til", rotation, by.up, rotation) @ _cross(np.eye(3)[2])
    for touch, placement in enumerate(touches.placement):
        stage = slice(6 * placement, 6 * placement + 6)
        J[touch, :, stage] = np.hstack([-np.eye(3), _cross(arms[touch]) - held[touch]])
        if touches.by_slave[touch]:
            J[touch, :, state.slave_columns] = np.hstack([np.eye(3), -_cross(turned_tips[touch])])
    J[:, :, -N_CORRECTIONS:] = -(rotation @ by.corrections)
    return J


def _covariance(
    touches: Touches, stage: Stage, by_reading: Float[Array, "touch 3 3"]
) -> Float[Array, "coordinate coordinate"]:
    """Covariance of the misclosures along the touching robots' axes [m2]."""
    n = len(touches)
    groups, kinds = touches.reading_groups()
    sigma = np.array([stage.sigma_slide, stage.sigma_angle, stage.sigma_rod])
    by_group = np.zeros((n, 3, len(kinds)))
    for touch, columns in enumerate(groups):
        for kind, column in enumerate(columns):
            if column >= 0:
                by_group[touch, :, column] = by_reading[touch, :, kind] * sigma[kind]
    spread = by_group.reshape(3 * n, -1)
    return np.asarray(touches.tip_covariance + spread @ spread.T)


def _level_rows(
    state: State, stage: Stage
) -> tuple[Float[Array, "row"], Float[Array, "row unknown"]]:
    """What levelling says: the rod's cross direction is horizontal, upright bases agree."""
    upright, slave_upright = np.eye(3)[2], state.slave[:3, 2]
    slave_turn = slice(state.slave_columns.start + 3, state.slave_columns.stop)
    values, rows = [], []
    for placement, frame in enumerate(state.stages):
        across, turn = frame[:3, 1], slice(6 * placement + 3, 6 * placement + 6)
        if not (stage.level_in_master or stage.level_in_slave):
            continue
        vertical = upright if stage.level_in_master else slave_upright
        row = np.zeros(state.size)
        # d(across) = turn x across, so d(across . vertical) = turn . (across x vertical).
        row[turn] = np.cross(across, vertical)
        if not stage.level_in_master:
            row[slave_turn] = -np.cross(across, vertical)
        values.append(across @ vertical)
        rows.append(row)
    if stage.level_in_master and stage.level_in_slave:
        for axis in np.eye(3)[:2]:
            row = np.zeros(state.size)
            row[slave_turn] = np.cross(slave_upright, axis)
            values.append(axis @ slave_upright)
            rows.append(row)
    return (
        np.array(values, dtype=float) / stage.sigma_level,
        np.array(rows).reshape(-1, state.size) / stage.sigma_level,
    )


def _prior_rows(
    state: State, stage: Stage
) -> tuple[Float[Array, "row"], Float[Array, "row unknown"]]:
    """One row for every correction that has a prior."""
    held = np.flatnonzero(stage.prior_std > 0)
    J = np.zeros((len(held), state.size))
    J[np.arange(len(held)), state.size - N_CORRECTIONS + held] = 1.0 / stage.prior_std[held]
    return state.corrections[held] / stage.prior_std[held], J


def _cross(v: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """Matrix of the cross product with `v` on the left."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])

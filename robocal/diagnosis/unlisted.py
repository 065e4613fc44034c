"""Causes outside the catalogue, as far as one can guess at them: a part that moves smoothly.

The tool, the base, a joint or the axis of a joint moves with some covariate, by a law that no
effect of the catalogue has. Such blocks are no names. They stand beside the named causes for the
place of an effect, so that a name which merely resembles the truth is not called sure.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.special import gammaincc

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.covariates import (
    ORIENTATION,
    SWAYS,
    clock,
    scaled_powers,
    seen_askew,
    sways,
    waves,
)
from robocal.diagnosis.effect import Moves, base_index, revolute_joints, theta, tool_index
from robocal.diagnosis.evidence import chi_square, log_bayes_factor
from robocal.diagnosis.linearised import Linearised

SHARE = 0.1
"""Prior of a cause outside the catalogue to one inside; [1]"""
_SHIFT = 1.5e-4
"""Prior size of a shift [m]"""
_TURN = 2e-4
"""Prior size of a turn [rad]"""
_RUN_OUT = 3e-5
"""Prior size of an axis' shift [m]"""


@dataclass(frozen=True)
class Block:
    """One part that moves with one covariate."""

    covariate: str
    X: Float[Array, "scalar coefficient"]
    prior_std: Float[Array, "coefficient"]


@dataclass(frozen=True)
class Unlisted:
    """How strongly a block speaks in the place of an effect."""

    covariate: str
    log_bf: float
    """With its share of the prior."""
    p_value: float
    """Chance of the block's score by noise."""


def blocks(rows: Circumstances, fit: Linearised) -> list[Block]:
    """Every part with every covariate that could move it."""
    found = []
    for covariate, moves, size in (*_shifts(rows), *_joints_by_others(rows)):
        X = fit.columns(moves)
        found.append(Block(covariate, X, np.full(X.shape[1], size)))
    return [*found, *_wobbles(rows, fit)]


def weigh(found: Sequence[Block], rest: Linearised) -> list[Unlisted]:
    """The blocks in the place that `rest` leaves open, most probable first."""
    weighed = []
    for block in found:
        M, b = rest.scored(block.X)
        evidence = float(log_bayes_factor(M, b, block.prior_std)) + np.log(SHARE / len(found))
        chi2 = float(chi_square(M, b))
        chance = float(gammaincc(0.5 * len(b), 0.5 * chi2))
        weighed.append(Unlisted(block.covariate, evidence, chance))
    return sorted(weighed, key=lambda one: -one.log_bf)


def _spread(first: int, basis: Float[Array, "row function"]) -> Moves:
    """Three shifts from a parameter on, each by every function."""
    k = basis.shape[1]
    return {
        first + axis: np.concatenate(
            [basis if here == axis else np.zeros_like(basis) for here in range(3)], axis=1
        )
        for axis in range(3)
        if k
    }


def _shifts(rows: Circumstances) -> Iterator[tuple[str, Moves, float]]:
    """Tool and base with temperature, payload and time; the base's steady drift has a name."""
    base, tool = base_index(rows), tool_index(rows)
    known = {"temperature_degc": rows.temperature, "payload_kg": rows.payload}
    for name, values in known.items():
        if np.isfinite(values).all() and np.ptp(values) > 0:
            powers = scaled_powers(values)
            for degree in (1, 2):
                yield name, _spread(tool, powers[:, :degree]), _SHIFT
            yield name, _spread(base, powers), _SHIFT
    powers = scaled_powers(rows.time)
    for degree in (1, 2):
        yield clock(rows), _spread(tool, powers[:, :degree]), _SHIFT
    half_periods = sways(rows)
    for k in range(1, SWAYS):
        yield clock(rows), _spread(base, half_periods[:, k - 1 : k + 1]), _SHIFT
    yield ORIENTATION, seen_askew(rows), _SHIFT


def _joints_by_others(rows: Circumstances) -> Iterator[tuple[str, Moves, float]]:
    """A joint turns once and twice a turn of another one."""
    for joint, driver in permutations(revolute_joints(rows), 2):
        moves = {theta(joint, rows): waves(rows.joints[:, driver - 1])}
        yield _reading(rows, driver), moves, _TURN


def _wobbles(rows: Circumstances, fit: Linearised) -> Iterator[Block]:
    """The axis of a joint runs out: tilt and shift turn around with it, once or twice a turn."""
    base = base_index(rows)
    for joint in revolute_joints(rows):
        before = 5 * (joint - 2)
        # About the x and the y that the axis starts from.
        tilt = (before + 3, before + 4) if joint > 1 else (base + 5, base + 4)
        x, y = rows.axes_before(joint)
        for order in (1, 2):
            turned = order * rows.joints[:, joint - 1]
            cos, sin = np.cos(turned), np.sin(turned)
            on_x, on_y = np.stack([cos, -sin], axis=1), np.stack([sin, cos], axis=1)
            tilts = {tilt[0]: on_x, tilt[1]: on_y}
            way = x[:, :, None] * on_x + y[:, :, None] * on_y
            shifts = {base + axis: way[axis] for axis in range(3)}
            X = np.concatenate([fit.columns(tilts), fit.columns(shifts)], axis=1)
            yield Block(_reading(rows, joint), X, np.repeat([_TURN, _RUN_OUT], 2))


def _reading(rows: Circumstances, joint: int) -> str:
    """What a joint's column is called."""
    return f"j{joint}_{rows.robot.joint_units[joint - 1]}"

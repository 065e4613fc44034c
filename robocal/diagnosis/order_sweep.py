r"""Gear harmonics of a joint at every order of a grid: a periodogram after projection.

With the weight u of a scalar's joint derivative and the basis of the model, all that is needed are
sums :math:`\sum_m v_m e^{i k q_m}` over the rows. The orders k form an even grid, so the sums are
Fourier sums of points that are not: the rows are spread over an even grid by a smooth kernel and
one fast transform gives all orders [1]_.

References
----------
.. [1] A. H. Barnett, J. Magland, L. af Klinteberg, "A parallel nonuniform fast Fourier transform
   library based on an exponential of semicircle kernel", SIAM J. Sci. Comput. 41(5), 2019.
"""

from collections.abc import Callable, Iterator
from functools import lru_cache

import numpy as np
from jaxtyping import Complex, Float
from numpy import ndarray as Array

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Instance, revolute_joints, theta
from robocal.diagnosis.effects.gear_harmonic import GearHarmonic
from robocal.diagnosis.group import Group
from robocal.diagnosis.linearised import Linearised

LOWEST_ORDER, HIGHEST_ORDER = 0.5, 400.0
"""Orders searched, cycles a turn; [1]"""
_OVERSAMPLING = 3.0
"""Grid points within one resolution of the order, which is one over the range in turns; [1]"""
_LEAST_CYCLES = 1.0
"""Less of a wave stands for anything smooth: a period that was not seen is not named; [1]"""
_LEAST_TURNS = 0.05
STRAIN_WAVE_RATIOS = (30, 50, 51, 80, 81, 100, 101, 120, 121, 160, 161)
"""As sold; one more where the circular spline turns. The error comes twice a turn of the motor."""
_STILL = 1e-3
"""A joint that moves less shows no order [rad]"""
_WIDTH = 10
"""Grid points that one row is spread over: sums good to 1e-8; [1]"""


def sweep_orders(
    rows: Circumstances, fit: Linearised, residuals: Float[Array, "scalar residual"]
) -> Iterator[Group]:
    """Gear harmonics of every revolute joint at every order of the grid."""
    effect = EFFECTS["gear_harmonic"]
    assert isinstance(effect, GearHarmonic)
    both = np.concatenate([fit.basis, residuals], axis=1)
    for joint in revolute_joints(rows):
        reading = rows.joints[:, joint - 1]
        if np.ptp(reading) < _STILL:
            continue
        orders = order_grid(reading)
        M, b = _score_grid(rows, fit, both, residuals.shape[1], joint, orders)
        yield Group(
            effect.name,
            joint,
            _at(effect, joint, orders),
            np.stack([effect.prior_at(orders)] * 2, axis=1),
            np.log(prior_of(orders)),
            M,
            b,
        )


def prior_of(orders: Float[Array, "order"]) -> Float[Array, "order"]:
    """Prior of every order of an even grid: half of it evenly, half where gears are sold."""
    prior = np.full(len(orders), 1.0 / len(orders))
    own = 2.0 * np.array(STRAIN_WAVE_RATIOS)
    own = own[(own > orders[0]) & (own < orders[-1])]
    if not len(own):
        return prior
    above = np.searchsorted(orders, own)
    sold = np.zeros(len(orders))
    np.add.at(sold, np.concatenate([above - 1, above]), 0.5 / len(own))
    return np.asarray(0.5 * (prior + sold))


def _at(
    effect: GearHarmonic, joint: int, orders: Float[Array, "order"]
) -> Callable[[int], Instance]:
    """The candidate at a position of the grid."""
    return lambda position: effect.at(joint, float(orders[position]))


def order_grid(reading: Float[Array, "row"]) -> Float[Array, "order"]:
    """Orders to try for a joint that moved over these readings: whole multiples of one step."""
    turns = max(np.ptp(reading) / (2 * np.pi), _LEAST_TURNS)
    step = 1.0 / (_OVERSAMPLING * turns)
    lowest = max(LOWEST_ORDER, _LEAST_CYCLES / turns)
    first, last = np.ceil(lowest / step), np.floor(HIGHEST_ORDER / step)
    return np.asarray(np.arange(first, last + 1.0) * step)


def _score_grid(
    rows: Circumstances,
    fit: Linearised,
    both: Float[Array, "scalar known_and_residual"],
    n_residuals: int,
    joint: int,
    orders: Float[Array, "order"],
) -> tuple[Float[Array, "order 2 2"], Float[Array, "order {n_residuals} 2"]]:
    """Information and scores of cosine and sine at each order of an even grid."""
    u = fit.W[theta(joint, rows)]
    step = float(orders[1] - orders[0])
    first, last = round(orders[0] / step), round(orders[-1] / step)
    angle = step * rows.joints[:, joint - 1]
    weight = fit.row_sums((u * u)[:, None])
    twice = fourier_sums(2.0 * angle, weight, last)[first:, 0]
    square = np.empty((len(orders), 2, 2))
    square[:, 0, 0] = 0.5 * (weight.sum() + twice.real)
    square[:, 1, 1] = 0.5 * (weight.sum() - twice.real)
    square[:, 0, 1] = square[:, 1, 0] = 0.5 * twice.imag
    sums = fourier_sums(angle, fit.row_sums(u[:, None] * both), last)[first:]
    seen = np.stack([sums.real, sums.imag], axis=1)
    inside = seen[:, :, : both.shape[1] - n_residuals]
    M = square - inside @ np.swapaxes(inside, 1, 2)
    return M, np.swapaxes(seen[:, :, both.shape[1] - n_residuals :], 1, 2)


def fourier_sums(
    angle: Float[Array, "row"], values: Float[Array, "row column"], last: int
) -> Complex[Array, "mode column"]:
    """Sums of values times exp(i k angle) for k from 0 to `last`."""
    from scipy.fft import next_fast_len, rfft
    from scipy.sparse import csr_array

    n = next_fast_len(max(4 * (last + 1), 4 * _WIDTH), real=True)
    place = np.remainder(angle, 2 * np.pi) * (n / (2 * np.pi))
    left = np.ceil(place - _WIDTH / 2)
    offsets = left[:, None] + np.arange(_WIDTH)
    spread = _kernel((offsets - place[:, None]) * (2.0 / _WIDTH))
    columns = np.repeat(np.arange(len(angle)), _WIDTH)
    index = np.remainder(offsets, n).astype(int).ravel()
    grid = csr_array((spread.ravel(), (index, columns)), shape=(n, len(angle))) @ values
    return np.asarray(np.conj(rfft(grid, axis=0)[: last + 1]) / _transform(last, n)[:, None])


def _kernel(z: Float[Array, "*some"]) -> Float[Array, "*some"]:
    """Exponential of a semicircle over [-1, 1]."""
    return np.asarray(np.exp(2.3 * _WIDTH * (np.sqrt(np.maximum(1.0 - z * z, 0.0)) - 1.0)))


@lru_cache(maxsize=64)
def _transform(last: int, n: int) -> Float[Array, "mode"]:
    """The kernel's own Fourier transform at the modes up to `last`, by Gauss's quadrature."""
    modes = np.arange(last + 1)
    nodes, weights = np.polynomial.legendre.leggauss(4 * _WIDTH)
    waves = np.cos(np.outer(modes, nodes * (np.pi * _WIDTH / n)))
    return np.asarray(waves @ (weights * _kernel(nodes)) * (_WIDTH / 2))


def score_orders(
    rows: Circumstances,
    fit: Linearised,
    joint: int,
    orders: Float[Array, "order"],
) -> tuple[Float[Array, "order 2 2"], Float[Array, "order 2"]]:
    """Information and scores of the fit's own residual at a few orders, one by one."""
    u = fit.W[theta(joint, rows)]
    phase = np.outer(orders, rows.joints[:, joint - 1])
    waves = np.stack([np.cos(phase), np.sin(phase)], axis=1)
    square = np.einsum("okm,olm,m->okl", waves, waves, fit.row_sums((u * u)[:, None])[:, 0])
    known = fit.row_sums(u[:, None] * fit.basis)
    inside = (waves.reshape(-1, waves.shape[2]) @ known).reshape(len(orders), 2, -1)
    M = square - inside @ np.swapaxes(inside, 1, 2)
    return M, waves @ fit.row_sums((u * fit.r)[:, None])[:, 0]

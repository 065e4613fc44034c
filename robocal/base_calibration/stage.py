r"""The sensing stage: from its three readings to the places of its two cups, with derivatives.

In the stage frame the guide runs along x (:math:`u`), the rod turns in the plane of x and y
(:math:`w`), and z completes them. At slide reading s, rod angle :math:`\varphi` and length
:math:`\ell`,

.. math::
   p_{slide} = (1 + k_s) s\,u, \qquad p_{rod} = p_{slide} + \ell' d - k_g f (g - (g d) d),

with :math:`d = R_z(\psi s) R_y(\varepsilon + \pi_s s) (-\cos\varphi', \sin\varphi', 0)`,
:math:`\varphi' = \varphi + \varphi_0`, :math:`\ell' = (1 + k_\ell)\ell + \ell_0`. So rod angle zero
points back along the guide. The last term is the sag of a cantilever under its own weight,
:math:`f = (\ell/\ell_{ref})^4`, with the upward direction g.

The slide's zero is no parameter: it moves the stage frame along the guide and nothing else.

References
----------
.. [1] Zhong et al., Manufacturing Technology & Machine Tool 12 (2022), 20-26, section 1; geometry
   as the printed numbers imply it (docs/base_calibration.md).
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.base_calibration.corrections import (
    ABBE_PITCH,
    ABBE_YAW,
    ANGLE_ZERO,
    N_CORRECTIONS,
    ROD_SCALE,
    ROD_ZERO,
    SAG,
    SLIDE_SCALE,
    SQUARENESS,
    default_prior_std,
)

_SAG_POWER = 4
"""A uniform cantilever sags with the fourth power of its length; [1]"""


@dataclass(frozen=True)
class Stage:
    """What is known of the stage before any touch.

    Parameters
    ----------
    sigma_slide, sigma_rod, sigma_angle
        Standard uncertainty of one reading [m, m, rad].
    level_in_master, level_in_slave
        The rod turns in the plane of the guide and the horizontal across it, and that robot's base
        stands upright. Where both hold, the two bases are upright together.
    sigma_level
        Standard uncertainty of such a statement [rad].
    prior_std
        Of each correction [m, rad, 1]; zero fixes it.
    """

    sigma_slide: float
    sigma_rod: float
    sigma_angle: float
    level_in_master: bool
    level_in_slave: bool
    sigma_level: float = 0.1e-3
    prior_std: Float[Array, "correction"] = field(default_factory=default_prior_std)


@dataclass(frozen=True)
class Readings:
    """Readings of the three sensors, one a touch."""

    slide: Float[Array, "*draw touch"]
    """[m]"""
    angle: Float[Array, "*draw touch"]
    """[rad]; without meaning at the slide cup."""
    length: Float[Array, "*draw touch"]
    """[m], from the slide cup to the rod cup; without meaning at the slide cup."""


@dataclass(frozen=True)
class CupDerivatives:
    """Derivatives of the cup positions in the stage frame."""

    readings: Float[Array, "touch 3 3"]
    """Column by slide, angle, length."""
    corrections: Float[Array, "touch 3 correction"]
    up: Float[Array, "touch 3 3"]
    """By the upward direction, through the sag."""


def cup_positions(
    readings: Readings,
    on_rod: Bool[Array, "touch"],
    corrections: Float[Array, "*draw correction"],
    up: Float[Array, "*draw touch 3"],
    rod_reference: float,
) -> Float[Array, "*draw touch 3"]:
    """Positions of the touched cups in the stage frame [m].

    Parameters
    ----------
    readings
        One a touch.
    on_rod
        True for the rod cup, False for the slide cup.
    corrections
        In the order of `corrections.CORRECTIONS`.
    up
        Upward direction in the stage frame.
    rod_reference
        Rod length at which the sag is stated [m].
    """
    c = corrections[..., None]
    slide = (1.0 + c[..., SLIDE_SCALE, :]) * readings.slide
    cup = slide[..., None] * np.array([1.0, 0.0, 0.0])
    d = _rod_directions(readings, corrections)[0]
    length = (1.0 + c[..., ROD_SCALE, :]) * readings.length + c[..., ROD_ZERO, :]
    sag = c[..., SAG, :] * (readings.length / rod_reference) ** _SAG_POWER
    across = up - (up * d).sum(axis=-1, keepdims=True) * d
    rod = length[..., None] * d - sag[..., None] * across
    return np.asarray(cup + np.where(on_rod[:, None], rod, 0.0))


def cup_derivatives(
    readings: Readings,
    on_rod: Bool[Array, "touch"],
    corrections: Float[Array, "correction"],
    up: Float[Array, "touch 3"],
    rod_reference: float,
) -> CupDerivatives:
    """Derivatives of `cup_positions` in closed form."""
    d, d_angle, d_pitch, d_yaw = _rod_directions(readings, corrections)
    share = (readings.length / rod_reference) ** _SAG_POWER
    sag = (corrections[SAG] * share)[:, None]
    length = ((1.0 + corrections[ROD_SCALE]) * readings.length + corrections[ROD_ZERO])[:, None]
    along = (up * d).sum(axis=1, keepdims=True)
    across = up - along * d

    def swing(turn: Float[Array, "touch 3"]) -> Float[Array, "touch 3"]:
        """Move of the cup when the rod's direction changes by `turn`."""
        lifted = (up * turn).sum(axis=1, keepdims=True)
        return np.asarray(length * turn + sag * (lifted * d + along * turn))

    by_angle, by_pitch, by_yaw = swing(d_angle), swing(d_pitch), swing(d_yaw)
    guide = np.zeros_like(d)
    guide[:, 0] = 1.0
    slide = readings.slide[:, None]
    by_correction = np.zeros((len(d), 3, N_CORRECTIONS))
    by_correction[:, :, ANGLE_ZERO] = by_angle
    by_correction[:, :, ROD_ZERO] = d
    by_correction[:, :, ROD_SCALE] = readings.length[:, None] * d
    by_correction[:, :, SQUARENESS] = by_pitch
    by_correction[:, :, ABBE_PITCH] = slide * by_pitch
    by_correction[:, :, ABBE_YAW] = slide * by_yaw
    by_correction[:, :, SAG] = -share[:, None] * across
    # d(sag share)/d(length) = 4 share / length, written so that no rod of length zero divides.
    steeper = corrections[SAG] * _SAG_POWER / rod_reference * (readings.length / rod_reference) ** 3
    by_length = (1.0 + corrections[ROD_SCALE]) * d - steeper[:, None] * across
    by_slide = corrections[ABBE_PITCH] * by_pitch + corrections[ABBE_YAW] * by_yaw
    by_reading = np.stack([by_slide, by_angle, by_length], axis=2)
    by_up = -sag[:, :, None] * (np.eye(3) - d[:, :, None] * d[:, None, :])
    for part in (by_correction, by_reading, by_up):
        part[~on_rod] = 0.0
    by_reading[:, :, 0] += (1.0 + corrections[SLIDE_SCALE]) * guide
    by_correction[:, :, SLIDE_SCALE] = slide * guide
    return CupDerivatives(by_reading, by_correction, by_up)


def _rod_directions(
    readings: Readings, corrections: Float[Array, "*draw correction"]
) -> tuple[
    Float[Array, "*draw touch 3"],
    Float[Array, "*draw touch 3"],
    Float[Array, "*draw touch 3"],
    Float[Array, "*draw touch 3"],
]:
    """Unit direction from slide cup to rod cup, and its derivatives by angle, pitch and yaw."""
    c = corrections[..., None]
    angle = readings.angle + c[..., ANGLE_ZERO, :]
    pitch = c[..., SQUARENESS, :] + c[..., ABBE_PITCH, :] * readings.slide
    yaw = c[..., ABBE_YAW, :] * readings.slide
    cos, sin, cp, sp = np.cos(angle), np.sin(angle), np.cos(pitch), np.sin(pitch)
    cy, sy = np.cos(yaw), np.sin(yaw)

    def turned(x: Array, y: Array, z: Array) -> Array:
        return np.asarray(np.stack([cy * x - sy * y, sy * x + cy * y, z], axis=-1))

    d = turned(-cos * cp, sin, cos * sp)
    by_angle = turned(sin * cp, cos, -sin * sp)
    by_pitch = turned(cos * sp, 0.0 * sin, cos * cp)
    by_yaw = np.stack([-d[..., 1], d[..., 0], 0.0 * d[..., 2]], axis=-1)
    return d, by_angle, by_pitch, by_yaw

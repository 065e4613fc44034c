r"""The least-squares problem: whitened residuals of measured rows and their derivatives.

Residual = measured - predicted. For positions it is the difference in the measuring frame over the
instrument's standard deviation; for orientations the rotation vector of
:math:`R_{measured} R_{predicted}^T` over that of the orientation. Priors enter as further rows.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.frames import rotation_from_quaternion, rotation_vector
from robocal.instrument import InstrumentNoise
from robocal.kinematics.forward import Columns, blocks, walk
from robocal.kinematics.jacobian import pose_jacobian
from robocal.kinematics.model import KinematicModel
from robocal.measurements import MeasurementSet

_BLOCK = 1000
_NEAR_HALF_TURN = -0.9
"""Cosine below which the sine of the angle no longer gives its direction well; [1]"""


@dataclass(frozen=True)
class Observations:
    """Measured rows as the fit needs them: arrays of columns, and weights instead of deviations.

    `axes` holds x, y, z of the measured target as (3, 3, row): component, axis, row; zero in rows
    without orientation, whose orientation weight is zero too.
    """

    joints: Float[Array, "row joint"]
    position: Float[Array, "3 row"]
    axes: Float[Array, "3 3 row"]
    position_weight: Float[Array, "row"]
    orientation_weight: Float[Array, "row"]

    def __len__(self) -> int:
        return len(self.joints)

    @property
    def n_scalars(self) -> int:
        """Number of measured scalars: three a position, three an orientation."""
        seen = np.count_nonzero(self.position_weight) + np.count_nonzero(self.orientation_weight)
        return 3 * int(seen)

    @property
    def has_orientation(self) -> bool:
        """Whether any row counts its orientation."""
        return bool(self.orientation_weight.any())

    def choose(self, rows: Bool[Array, "row"]) -> "Observations":
        """The rows where `rows` is True."""
        return Observations(
            self.joints[rows],
            self.position[:, rows],
            self.axes[:, :, rows],
            self.position_weight[rows],
            self.orientation_weight[rows],
        )

    def without_position(self) -> "Observations":
        """The orientation alone."""
        return replace(self, position_weight=np.zeros_like(self.position_weight))


def observations(rows: MeasurementSet, noise: InstrumentNoise) -> Observations:
    """Rows with positions (and orientations where there are any), weighted by the instrument."""
    turned = rows.has_orientation
    axes = np.zeros((3, 3, len(rows)))
    if turned.any():
        rotations = rotation_from_quaternion(rows.orientation[turned])
        axes[:, :, turned] = np.moveaxis(rotations, 0, 2)
    return Observations(
        joints=rows.joints,
        position=np.ascontiguousarray(rows.position.T),
        axes=axes,
        position_weight=1.0 / noise.position_std(rows.position),
        orientation_weight=np.where(turned, 1.0 / noise.orientation, 0.0),
    )


@dataclass(frozen=True)
class NormalEquations:
    """Half the squared whitened residuals, their gradient and Gauss-Newton Hessian."""

    cost: float
    gradient: Float[Array, "free"]
    hessian: Float[Array, "free free"]


def residuals(
    model: KinematicModel, rows: Observations
) -> tuple[Float[Array, "3 row"], Float[Array, "3 row"]]:
    """Position residuals [m] and orientation residuals [rad], zero where there is none."""
    position = np.empty((3, len(rows)))
    orientation = np.zeros((3, len(rows)))
    for block in blocks(len(rows)):
        last, _ = walk(model, rows.joints[block])
        target = last.then(model.tool_frame)
        position[:, block] = rows.position[:, block] - target.p
        if rows.has_orientation:
            orientation[:, block] = rotation_residual(rows.axes[:, :, block], target)
    return position, orientation * (rows.orientation_weight > 0)


def rotation_residual(axes: Float[Array, "3 3 row"], predicted: Columns) -> Float[Array, "3 row"]:
    r"""Rotation vectors that turn predicted axes onto measured ones [rad].

    With :math:`m_k = R p_k` for the three axes, :math:`\sum_k p_k \times m_k = 2 \sin\vartheta\,n`
    and :math:`\sum_k p_k \cdot m_k = 1 + 2 \cos\vartheta`.
    """
    p = np.stack(np.broadcast_arrays(predicted.x, predicted.y, predicted.z), axis=1)
    sine = 0.5 * np.stack([
        (p[1] * axes[2] - p[2] * axes[1]).sum(axis=0),
        (p[2] * axes[0] - p[0] * axes[2]).sum(axis=0),
        (p[0] * axes[1] - p[1] * axes[0]).sum(axis=0),
    ])
    cosine = 0.5 * ((p * axes).sum(axis=(0, 1)) - 1.0)
    length = np.sqrt((sine * sine).sum(axis=0))
    angle = np.arctan2(length, cosine)
    vector = sine * np.where(length > 1e-12, angle / np.maximum(length, 1e-300), 1.0)
    far = cosine < _NEAR_HALF_TURN
    if far.any():
        turns = np.einsum("ikm,jkm->mij", axes[:, :, far], p[:, :, far])
        vector[:, far] = rotation_vector(turns).T
    return np.asarray(vector)


def normal_equations(
    model: KinematicModel, rows: Observations, free: Int[Array, "free"]
) -> NormalEquations:
    """Cost, gradient and Hessian over the free parameters, without priors."""
    cost = 0.0
    gradient = np.zeros(len(free))
    hessian = np.zeros((len(free), len(free)))
    for J, r in whitened_blocks(model, rows, free):
        cost += 0.5 * float(r @ r)
        gradient -= J @ r
        hessian += J @ J.T
    return NormalEquations(cost, gradient, hessian)


def whitened_jacobian(
    model: KinematicModel, rows: Observations, free: Int[Array, "free"]
) -> Float[Array, "scalar free"]:
    """Derivative of the whitened prediction, every measured scalar a row. For few poses."""
    return np.concatenate([J for J, _ in whitened_blocks(model, rows, free)], axis=1).T


def whitened_blocks(
    model: KinematicModel, rows: Observations, free: Int[Array, "free"]
) -> Iterator[tuple[Float[Array, "free scalar"], Float[Array, "scalar"]]]:
    """Pairs of Jacobian (free, scalar) and residual (scalar), block by block."""
    components = slice(0, 6) if rows.has_orientation else slice(0, 3)
    for block in blocks(len(rows), _BLOCK):
        target, J = pose_jacobian(model, rows.joints[block])
        n = len(rows.joints[block])
        weight = np.empty((6, n))
        weight[:3] = rows.position_weight[block]
        weight[3:] = rows.orientation_weight[block]
        r = np.zeros((6, n))
        r[:3] = rows.position[:, block] - target.p
        if rows.has_orientation:
            r[3:] = rotation_residual(rows.axes[:, :, block], target)
        weight = weight[components]
        whitened = J[free, components] * weight
        yield whitened.reshape(len(free), -1), (r[components] * weight).ravel()

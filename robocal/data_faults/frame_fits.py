r"""Robust fits of nominal flange poses to measured points, for many hypotheses at once.

With flange poses :math:`(R_i, P_i)` and measured points :math:`p_i` of target :math:`k_i`, all
frames obey :math:`C p_i = P_i + R_i t_{k_i} + s`. With `C` any 3 x 3 matrix this is linear
(`loose_fits`), which is quick and shows a wrong unit (its size); with `C` a rotation it is the true
question (`rigid_fits`). Rows are reweighted by 1 / residual, so that a few bad ones do not count.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.frames import rotation_from_quaternion
from robocal.identification.rotation_search import minimise_on_rotations

QUANTILE = 0.85
"""A fit is judged by the residual that this share of the rows stays below."""
_LOOSE_STEPS = 5
_RIGID_STEPS = 12
_LEAST_SPREAD = 1e-9
"""Of one pose measured again and again [m]"""
_RIDGE = 1e-9
"""Keeps directions that the poses leave open at rest, relative to the others."""


@dataclass(frozen=True)
class LooseFits:
    """One fit a hypothesis, with any 3 x 3 matrix in place of the rotation."""

    matrix: Float[Array, "hypothesis 3 3"]
    """C: robot metres for one metre of the file."""
    misfit: Float[Array, "hypothesis"]
    """Residual over the spread of the points as the robot sees it [1]."""
    weight: Float[Array, "hypothesis row"]


@dataclass(frozen=True)
class RigidFit:
    """Frames of one hypothesis."""

    rotation: Float[Array, "3 3"]
    """C: the robot base seen from the measuring frame, transposed."""
    places: Float[Array, "place 3"]
    """Of every target in the flange; zero where no row shows it."""
    offset: Float[Array, "3"]
    residuals: Float[Array, "row"]
    """Distance of every row [m]."""

    @property
    def score(self) -> float:
        """What `QUANTILE` of the rows stay below [m]."""
        return float(np.quantile(self.residuals, QUANTILE))


def spread_of(points: Float[Array, "row 3"]) -> float:
    """Robust distance of the points from their centre, as a root mean square [m]; never zero."""
    distance = np.linalg.norm(points - np.median(points, axis=0), axis=1)
    spread = np.sqrt(np.mean(np.minimum(distance, 3.0 * np.median(distance)) ** 2))
    return max(float(spread), _LEAST_SPREAD)


def loose_fits(
    R: Float[Array, "hypothesis row 3 3"],
    P: Float[Array, "hypothesis row 3"],
    p: Float[Array, "hypothesis row 3"],
    place: Int[Array, "hypothesis row"],
) -> LooseFits:
    """Fit every hypothesis with a free matrix; `place` numbers the targets."""
    centre = np.median(p, axis=1, keepdims=True)
    spread = np.array([spread_of(points) for points in p])
    design = _loose_design(R, (p - centre) / spread[:, None, None], place)
    columns = design.shape[-1]
    weight = np.ones(P.shape[:2])
    solution = np.empty((len(P), columns))
    residual = np.empty(P.shape[:2])
    for _ in range(_LOOSE_STEPS):
        solution = _weighted_solution(design, P, weight)
        predicted = (design.reshape(len(P), -1, columns) @ solution[:, :, None]).reshape(P.shape)
        residual = np.linalg.norm(predicted - P, axis=2)
        weight = _downweighted(residual)
    C = solution[:, :9].reshape(-1, 3, 3)
    size = np.linalg.norm(C, axis=(1, 2)) / np.sqrt(3.0)
    misfit = np.quantile(residual, QUANTILE, axis=1) / np.maximum(size, 1e-12)
    return LooseFits(C / spread[:, None, None], misfit, weight)


def _loose_design(
    R: Float[Array, "hypothesis row 3 3"],
    p: Float[Array, "hypothesis row 3"],
    place: Int[Array, "hypothesis row"],
) -> Float[Array, "hypothesis row 3 column"]:
    """Columns of the nine entries of C (row by row), of every t and of s."""
    C = np.zeros((*R.shape[:2], 3, 9))
    for axis in range(3):
        C[:, :, axis, 3 * axis : 3 * axis + 3] = p
    return np.concatenate([C, _frame_columns(R, place)], axis=3)


def _frame_columns(
    R: Float[Array, "hypothesis row 3 3"], place: Int[Array, "hypothesis row"]
) -> Float[Array, "hypothesis row 3 column"]:
    """Columns of every t and of s."""
    n_places = int(place.max()) + 1
    of_place = place[:, :, None] == np.arange(n_places)
    t = -R[:, :, :, None, :] * of_place[:, :, None, :, None]
    s = np.broadcast_to(-np.eye(3), R.shape)
    return np.concatenate([t.reshape(*R.shape[:3], 3 * n_places), s], axis=3)


def _weighted_solution(
    design: Float[Array, "hypothesis row 3 column"],
    target: Float[Array, "hypothesis row 3"],
    weight: Float[Array, "hypothesis row"],
) -> Float[Array, "hypothesis column"]:
    """Weighted least squares; open directions stay at zero."""
    n, columns = len(design), design.shape[-1]
    flat = design.reshape(n, -1, columns)
    weighted = (design * weight[:, :, None, None]).reshape(n, -1, columns).swapaxes(1, 2)
    normal = weighted @ flat
    size = np.trace(normal, axis1=1, axis2=2) / columns
    normal += _RIDGE * size[:, None, None] * np.eye(columns)
    right = weighted @ target.reshape(n, -1, 1)
    return np.asarray(np.linalg.solve(normal, right)[:, :, 0])


def _downweighted(residual: Float[Array, "hypothesis row"]) -> Float[Array, "hypothesis row"]:
    """1 / residual, level below the median: the median of the rows decides, not the worst."""
    median = np.median(residual, axis=1, keepdims=True) + 1e-9
    return np.asarray(median / np.maximum(residual, median))


def rigid_fits(
    R: Float[Array, "hypothesis row 3 3"],
    P: Float[Array, "hypothesis row 3"],
    p: Float[Array, "hypothesis row 3"],
    place: Int[Array, "hypothesis row"],
    start: Float[Array, "hypothesis 3 3"],
) -> list[RigidFit]:
    """Gauss-Newton from the rotations nearest to `start`, reweighted at every step."""
    centre = np.median(p, axis=1, keepdims=True)
    points = p - centre
    C = _nearest_rotations(start)
    frames = _frame_columns(R, place)
    design = np.concatenate([np.zeros((*R.shape[:2], 3, 3)), frames], axis=3)
    weight = np.ones(P.shape[:2])
    solution, residual = np.empty((len(P), design.shape[-1])), np.empty(P.shape[:2])
    for step in range(_RIGID_STEPS):
        turned = points @ C.swapaxes(1, 2)
        x, y, z = np.moveaxis(turned, 2, 0)
        design[..., 0, 1], design[..., 0, 2] = z, -y
        design[..., 1, 0], design[..., 1, 2] = -z, x
        design[..., 2, 0], design[..., 2, 1] = y, -x
        solution = _weighted_solution(design, P - turned, weight)
        C = _turns(solution[:, :3]) @ C
        turned = points @ C.swapaxes(1, 2)
        carried = (frames @ solution[:, None, 3:, None])[..., 0]
        residual = np.linalg.norm(turned - P + carried, axis=2)
        weight = _downweighted(residual)
        if step > 3 and np.abs(solution[:, :3]).max() < 1e-7:
            break
    return [
        RigidFit(
            C[h],
            solution[h, 3:-3].reshape(-1, 3),
            solution[h, -3:] + C[h] @ centre[h, 0],
            residual[h],
        )
        for h in range(len(P))
    ]


def global_start(
    R: Float[Array, "row 3 3"],
    P: Float[Array, "row 3"],
    p: Float[Array, "row 3"],
    place: Int[Array, "row"],
    weight: Float[Array, "row"],
) -> Float[Array, "3 3"]:
    """The rotation that fits best of all: every t and s are eliminated, the rest is searched."""
    design = _loose_design(R[None], (p - np.median(p, axis=0))[None], place[None])[0]
    design = design.reshape(-1, design.shape[-1])
    weighted = design.T * np.repeat(weight, 3)
    normal, right = weighted @ design, weighted @ P.ravel()
    inner = normal[9:, 9:] + _RIDGE * np.trace(normal[9:, 9:]) * np.eye(len(normal) - 9)
    swept = np.linalg.solve(inner, np.column_stack([normal[9:, :9], right[9:]]))
    A = normal[:9, :9] - normal[:9, 9:] @ swept[:, :9]
    return minimise_on_rotations(0.5 * (A + A.T), right[:9] - normal[:9, 9:] @ swept[:, 9])


def _nearest_rotations(M: Float[Array, "hypothesis 3 3"]) -> Float[Array, "hypothesis 3 3"]:
    U, _, Vt = np.linalg.svd(M)
    U[:, :, 2] *= np.sign(np.linalg.det(U @ Vt))[:, None]
    return np.asarray(U @ Vt)


def _turns(vectors: Float[Array, "hypothesis 3"]) -> Float[Array, "hypothesis 3 3"]:
    """Rotations of rotation vectors; angles above a radian are cut, as steps are local."""
    angle = np.linalg.norm(vectors, axis=1, keepdims=True)
    half = 0.5 * np.minimum(angle, 1.0)
    axis = vectors / np.maximum(angle, 1e-300)
    return rotation_from_quaternion(np.concatenate([np.cos(half), np.sin(half) * axis], axis=1))

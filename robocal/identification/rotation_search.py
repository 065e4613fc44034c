"""The rotation at which a quadratic form of its nine entries is least, over the whole of SO(3)."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.frames import nearest_rotation, rotation_from_quaternion

_N_STARTS = 400
_N_REFINED = 6
_MAX_STEPS = 60


def minimise_on_rotations(A: Float[Array, "9 9"], b: Float[Array, "9"]) -> Float[Array, "3 3"]:
    """The rotation B with the least vec(B)^T A vec(B) - 2 b^T vec(B).

    Every form is evaluated at a fixed spread of rotations; the best of them are refined.
    """
    quaternions = np.random.default_rng(0).normal(size=(_N_STARTS, 4))
    starts = rotation_from_quaternion(quaternions)
    flat = starts.reshape(-1, 9)
    values = ((flat @ A) * flat).sum(axis=1) - 2.0 * flat @ b
    best: Float[Array, "3 3"] = starts[0]
    best_value = np.inf
    for index in np.argsort(values)[:_N_REFINED]:
        B, value = _descend(starts[index], A, b)
        if value < best_value:
            best, best_value = B, value
    return best


def _descend(
    B: Float[Array, "3 3"], A: Float[Array, "9 9"], b: Float[Array, "9"]
) -> tuple[Float[Array, "3 3"], float]:
    """Damped Gauss-Newton over small turns from the left."""

    def value_of(rotation: Float[Array, "3 3"]) -> float:
        flat = rotation.ravel()
        return float(flat @ A @ flat - 2.0 * b @ flat)

    generators = np.zeros((3, 3, 3))
    for k, (i, j) in enumerate(((2, 1), (0, 2), (1, 0))):
        generators[k, i, j], generators[k, j, i] = 1.0, -1.0
    value, damping = value_of(B), 1e-3
    for _ in range(_MAX_STEPS):
        L = np.stack([(S @ B).ravel() for S in generators], axis=1)
        gradient = L.T @ (A @ B.ravel() - b)
        hessian = L.T @ A @ L
        size = np.trace(hessian) / 3.0 + 1e-300
        step = -np.linalg.solve(hessian + damping * size * np.eye(3), gradient)
        trial = nearest_rotation((np.eye(3) + np.tensordot(step, generators, 1)) @ B)
        trial_value = value_of(trial)
        if trial_value < value:
            done = value - trial_value < 1e-12 * abs(value)
            B, value, damping = trial, trial_value, max(0.2 * damping, 1e-9)
            if done:
                break
        else:
            damping *= 8.0
            if damping > 1e9:
                break
    return B, value

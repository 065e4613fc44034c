"""What a plan varies besides the joints, so that diagnosis can tell causes apart.

Approach directions: each joint comes into half of the poses from below and into half from above,
so that backlash is not taken for geometry. Payloads: each is carried at half of the poses, chosen
so that either half alone still determines the geometry. Repeats: some poses are visited again under
the same conditions, which gives the pure error that lack of fit is judged against.

Assignments are drawn at random, each balanced, and the one that says most is taken.
"""

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.planning.chosen_set import RIDGE, Rows
from robocal.planning.pose_rows import PoseRows

_TRIALS = 300
"""Random assignments among which the best is taken"""


def approach_directions(
    rows: PoseRows, chosen: Int[Array, "chosen"], seed: int
) -> Int[Array, "chosen joint"]:
    """Direction, -1 or 1, in which each joint comes into each pose.

    Of `_TRIALS` balanced assignments, the one whose backlash columns keep the largest determinant
    once the geometry has explained of them what it can.
    """
    rng = np.random.default_rng(seed)
    moves = rows.moves[chosen]
    moves = moves / np.linalg.norm(moves, axis=(0, 1))
    geometry, _ = np.linalg.qr(rows.J[chosen].reshape(-1, rows.J.shape[2]))
    best, best_value = np.ones((len(chosen), moves.shape[2]), dtype=int), -np.inf
    for _ in range(_TRIALS):
        signs = _balanced(len(chosen), moves.shape[2], rng)
        columns = (moves * signs[:, None, :]).reshape(-1, moves.shape[2])
        left = columns - geometry @ (geometry.T @ columns)
        value = _logdet(left.T @ left)
        if value > best_value:
            best, best_value = signs, value
    return best


def payload_halves(J: Rows, chosen: Int[Array, "chosen"], seed: int) -> Int[Array, "chosen"]:
    """0 or 1 for each pose: which of two payloads it is visited with.

    Of `_TRIALS` balanced divisions, the one that maximises the sum of both halves' log
    determinants.
    """
    rng = np.random.default_rng(seed)
    own = np.swapaxes(J[chosen], 1, 2) @ J[chosen]
    best, best_value = np.zeros(len(chosen), dtype=int), -np.inf
    for _ in range(_TRIALS):
        half = (_balanced(len(chosen), 1, rng)[:, 0] + 1) // 2
        value = sum(_logdet(own[half == part].sum(axis=0)) for part in (0, 1))
        if value > best_value:
            best, best_value = half, value
    return best


def repeated_poses(J: Rows, chosen: Int[Array, "chosen"], extra: int) -> Int[Array, "chosen"]:
    """Further visits of each pose, `extra` in all, where they bring the most information.

    Each goes to a pose not repeated yet while there is one, so that the pure error comes from all
    over the workspace.
    """
    further = np.zeros(len(chosen), dtype=int)
    rows = J[chosen]
    flat = rows.reshape(-1, J.shape[2])
    M = flat.T @ flat + RIDGE * np.eye(J.shape[2])
    for _ in range(extra):
        S = rows @ np.linalg.inv(M) @ np.swapaxes(rows, 1, 2)
        gain = np.linalg.slogdet(np.eye(J.shape[1]) + S)[1]
        gain[further > further.min()] = -np.inf
        pose = int(np.argmax(gain))
        further[pose] += 1
        M = M + rows[pose].T @ rows[pose]
    return further


def _balanced(n_poses: int, n_columns: int, rng: np.random.Generator) -> Int[Array, "pose column"]:
    """Signs of which each column has as many up as down, one more where the number is odd."""
    signs = np.ones((n_poses, n_columns), dtype=int)
    for column in signs.T:
        column[rng.permutation(n_poses)[: n_poses // 2]] = -1
    return signs


def _logdet(M: Float[Array, "n n"]) -> float:
    return float(np.linalg.slogdet(M + RIDGE * np.eye(len(M)))[1])

r"""Poses whose Jacobian has the largest determinant: greedy start, then exchanges.

Adding pose i to the information matrix M multiplies its determinant by
:math:`\det(I + J_i M^{-1} J_i^T)`, so the best pose is found without any new factorisation.

References
----------
.. [1] V. V. Fedorov, *Theory of Optimal Experiments*, Academic Press, 1972.
"""

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.identification.redundancy import find_redundancy
from robocal.kinematics.jacobian import pose_jacobian
from robocal.planning.candidates import draw_candidates
from robocal.robots.robot import Robot

_CANDIDATES = 400
_MAX_SWEEPS = 10
_RIDGE = 1e-6
"""Stands in for the information of poses not yet chosen, on columns of length one; [1]"""
TOOL_POINT = (0.05, 0.03, 0.1)
"""Where the target is thought to be on the flange while planning; off the last axis, so that every
parameter shows [m]"""


def plan_poses(robot: Robot, count: int, seed: int) -> Float[Array, "pose joint"]:
    """Joint readings to measure, the most informative of random admissible ones.

    Parameters
    ----------
    robot
        Nominal robot.
    count
        Number of poses.
    seed
        Of the candidates; the same seed gives the same poses.

    Raises
    ------
    NoAnswer
        If hardly any pose is admissible.
    """
    rng = np.random.default_rng(seed)
    candidates = draw_candidates(robot, max(_CANDIDATES, 4 * count), rng)
    J = _scaled_jacobian(robot, candidates)
    return in_short_order(candidates[exchange(J, count)])


def _scaled_jacobian(
    robot: Robot, q: Float[Array, "pose joint"]
) -> Float[Array, "pose 3 identified"]:
    """Position rows of the identifiable parameters, columns scaled to length one."""
    tool = np.eye(4)
    tool[:3, 3] = TOOL_POINT
    geometry = robot.geometry
    model = geometry.with_frames(np.eye(4), geometry.flange @ tool)
    _, J = pose_jacobian(model, q)
    rows = np.moveaxis(J[:, :3], 0, 2)  # (3, pose, parameter)
    flat = np.moveaxis(rows, 0, 1).reshape(-1, model.n_parameters)
    everything = np.ones(model.n_parameters, dtype=bool)
    unbounded = np.full(model.n_parameters, np.inf)
    kept = find_redundancy(flat, model, everything, unbounded).identified
    flat = flat[:, kept]
    return np.asarray((flat / np.linalg.norm(flat, axis=0)).reshape(len(q), 3, -1))


def exchange(J: Float[Array, "pose row parameter"], count: int) -> Int[Array, "chosen"]:
    """Indices of `count` poses with a large determinant of the information matrix."""
    n = J.shape[2]
    M = _RIDGE * np.eye(n)
    chosen: list[int] = []
    for _ in range(count):
        best = _best_addition(J, M, chosen)
        chosen.append(best)
        M = M + J[best].T @ J[best]
    for _ in range(_MAX_SWEEPS):
        moved = False
        for position, old in enumerate(list(chosen)):
            without = M - J[old].T @ J[old]
            rest = chosen[:position] + chosen[position + 1 :]
            best = _best_addition(J, without, rest)
            if best != old:
                moved = True
            chosen[position] = best
            M = without + J[best].T @ J[best]
        if not moved:
            break
    return np.array(chosen)


def _best_addition(
    J: Float[Array, "pose row parameter"], M: Float[Array, "parameter parameter"], taken: list[int]
) -> int:
    """The candidate, not yet taken, that multiplies the determinant most."""
    inverse = np.linalg.inv(M)
    growth = np.eye(J.shape[1]) + J @ inverse @ np.swapaxes(J, 1, 2)
    gain = np.linalg.slogdet(growth)[1]
    gain[taken] = -np.inf
    return int(np.argmax(gain))


def in_short_order(q: Float[Array, "pose joint"]) -> Float[Array, "pose joint"]:
    """The same poses, each followed by the nearest one left (largest joint move)."""
    left = list(range(1, len(q)))
    order = [0]
    while left:
        distance = np.abs(q[left] - q[order[-1]]).max(axis=1)
        order.append(left.pop(int(np.argmin(distance))))
    return q[order]

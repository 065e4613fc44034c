"""Joints of the nominal robot at wanted poses, where the user gives none.

They are found from a spread of starts, all targets in one configuration if the arm allows it.
"""

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.kinematics.forward import forward_kinematics
from robocal.kinematics.model import KinematicModel
from robocal.pose_solver import LEVER, configurations, inside_limits, solve_joints

_ITERATIONS = 12
"""From a far start: what has not come close by then starts again elsewhere."""
_STARTS = 20_000
_ROUNDS = 10
"""Starts that are tried for one target."""
_SAMPLE = 200
"""Targets that decide which configuration is used for all."""


def find_nominal_joints(
    nominal: KinematicModel, wanted: Float[Array, "pose 4 4"], limits: Float[Array, "joint 2"]
) -> Float[Array, "pose joint"]:
    """Joints of the nominal robot at the wanted poses, from a spread of starts.

    The configuration in which most of a sample of targets can be reached is used for all; a target
    that it does not reach takes another one. Full turns are those nearest to the target before.
    Where no start leads to the target, the joints of the nearest start are returned.
    """
    middle = limits.mean(axis=1)
    half = np.diff(limits, axis=1)[:, 0] / 2
    half = np.where(nominal.prismatic, half, np.minimum(half, np.pi))
    spread = middle + np.random.default_rng(1).uniform(-half, half, (_STARTS, len(half)))
    kinds = configurations(nominal, spread)
    sample = np.linspace(0, len(wanted) - 1, min(len(wanted), _SAMPLE)).astype(int)
    q, found = _search(nominal, wanted[sample], limits, spread)
    reached = configurations(nominal, q[found])
    common = int(np.bincount(reached).argmax()) if len(reached) else 0
    q, found = _search(nominal, wanted, limits, spread[kinds == common])
    rest = np.flatnonzero(~found)
    if len(rest):
        q[rest], _ = _search(nominal, wanted[rest], limits, spread)
    return _near_turns(q, limits, nominal)


def _search(
    nominal: KinematicModel,
    wanted: Float[Array, "pose 4 4"],
    limits: Float[Array, "joint 2"],
    spread: Float[Array, "start joint"],
) -> tuple[Float[Array, "pose joint"], Bool[Array, "pose"]]:
    """Joints within limits from the starts whose poses are nearest, one after the other.

    Only solutions in the configuration of their start count.
    """
    from scipy.spatial import KDTree

    tree = KDTree(_pose_features(forward_kinematics(nominal, spread)))
    features = _pose_features(wanted)
    q = spread[np.asarray(tree.query(features)[1])]
    rows = np.arange(len(wanted))
    middle = limits.mean(axis=1)
    for place in range(1, _ROUNDS + 1):
        start = spread[np.asarray(tree.query(features[rows], k=[place])[1])[:, 0]]
        solution = solve_joints(nominal, wanted[rows], start, _ITERATIONS, roughly=True)
        turned = np.remainder(solution.q - middle + np.pi, 2 * np.pi) + middle - np.pi
        turned = np.where(nominal.prismatic, solution.q, turned)
        kept = configurations(nominal, start) == configurations(nominal, turned)
        done = solution.met & kept & inside_limits(turned, limits)
        q[rows[done]] = turned[done]
        rows = rows[~done]
        if not len(rows):
            break
    found = np.ones(len(wanted), dtype=bool)
    found[rows] = False
    return q, found


def _pose_features(T: Float[Array, "pose 4 4"]) -> Float[Array, "pose 12"]:
    """Coordinates in which near poses are near: position, and axes at the lever."""
    return np.concatenate([T[:, :3, 3], LEVER * T[:, :3, :3].reshape(-1, 9)], axis=1)


def _near_turns(
    q: Float[Array, "pose joint"], limits: Float[Array, "joint 2"], model: KinematicModel
) -> Float[Array, "pose joint"]:
    """The same poses with every full turn as near to the row before as the limits allow."""
    turn = 2 * np.pi
    wide = ~model.prismatic & (np.diff(limits, axis=1)[:, 0] > turn)
    for joint in np.flatnonzero(wide):
        low, high = limits[joint].tolist()
        previous, readings = (low + high) / 2, q[:, joint].tolist()
        for row, reading in enumerate(readings):
            near = reading + turn * round((previous - reading) / turn)
            previous = near + turn * ((near < low) - (near > high))
            readings[row] = previous
        q[:, joint] = readings
    return q

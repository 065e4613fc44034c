"""Target poses and Jacobians of many draws of one cell at the same joint readings.

Columns run over draws, and within a draw over rows: column = draw * rows + row.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.identification.cell_model import CellModel
from robocal.kinematics.forward import Columns, JointColumns, chain
from robocal.kinematics.model import KinematicModel


@dataclass(frozen=True)
class TurnedFrame:
    """A six-parameter frame of every draw, and the directions in which its parameters move it."""

    shifts: Float[Array, "3 3 _"]
    """Directions of x, y, z: component, axis, column."""
    turns: Float[Array, "3 3 _"]
    """Axes of yaw, pitch, roll."""
    frame: Columns


@dataclass(frozen=True)
class ManyTargets:
    """Targets of every column, and what their derivatives need."""

    target: Columns
    base: TurnedFrame
    tool: TurnedFrame
    joints: list[JointColumns]


def draws_at_place(
    cell: CellModel, vectors: Float[Array, "parameter draw"], place: int
) -> tuple[KinematicModel, Float[Array, "own draw"]]:
    """The robot with its target at a place, and its own parameters of every draw."""
    model = cell.at_place(place)
    columns, own = cell.columns_at_place(place)
    mine = np.repeat(model.vector[:, None], vectors.shape[1], axis=1)
    mine[own] = vectors[columns]
    return model, mine


def many_targets(
    model: KinematicModel, vectors: Float[Array, "own draw"], q: Float[Array, "row joint"]
) -> ManyTargets:
    """Target frames of every draw at every row of joint readings.

    Parameters
    ----------
    model
        Gives the constant frames and the kinds of joints; its own parameters are not used.
    vectors
        Parameters of every draw [m, rad].
    q
        Joint readings [rad or m].
    """
    n_rows, n_draws = len(q), vectors.shape[1]
    n = 5 * model.n_joints
    links = np.repeat(vectors[:n].reshape(model.n_joints, 5, n_draws), n_rows, axis=2)
    base = turned_frame(_constant(model.station), np.repeat(vectors[n : n + 6], n_rows, axis=1))
    start = base.frame.then(model.mount)
    last, joints = chain(start, links, model.prismatic, np.tile(q.T, n_draws))
    tool = turned_frame(last.then(model.flange), np.repeat(vectors[n + 6 :], n_rows, axis=1))
    return ManyTargets(tool.frame, base, tool, joints)


def many_jacobians(targets: ManyTargets) -> Float[Array, "own 6 column"]:
    """Derivatives as `kinematics.jacobian.pose_jacobian` gives them, for every column."""
    p = targets.target.p
    J = np.zeros((5 * len(targets.joints) + 12, 6, p.shape[1]))
    for link, joint in enumerate(targets.joints):
        theta, d, a, alpha, beta = J[5 * link : 5 * link + 5]
        _turn(theta, joint.z, joint.before, p)
        d[:3] = joint.z
        a[:3] = joint.x
        _turn(alpha, joint.x, joint.after, p)
        _turn(beta, joint.y, joint.after, p)
    for columns, frame in ((J[-12:-6], targets.base), (J[-6:], targets.tool)):
        for axis in range(3):
            columns[axis, :3] = frame.shifts[:, axis]
            _turn(columns[3 + axis], frame.turns[:, axis], frame.frame.p, p)
    return J


def turned_frame(parent: Columns, parameters: Float[Array, "6 column"]) -> TurnedFrame:
    """The frame Trans(x, y, z) Rz(yaw) Ry(pitch) Rx(roll) behind `parent`."""
    shift, (yaw, pitch, roll) = parameters[:3], parameters[3:]
    x, y, z = parent.x, parent.y, parent.z
    p = parent.p + x * shift[0] + y * shift[1] + z * shift[2]
    after_x = x * np.cos(yaw) + y * np.sin(yaw)
    after_y = y * np.cos(yaw) - x * np.sin(yaw)
    turned_x = after_x * np.cos(pitch) - z * np.sin(pitch)
    turned_z = z * np.cos(pitch) + after_x * np.sin(pitch)
    frame = Columns(
        turned_x,
        after_y * np.cos(roll) + turned_z * np.sin(roll),
        turned_z * np.cos(roll) - after_y * np.sin(roll),
        p,
    )
    return TurnedFrame(
        np.stack(np.broadcast_arrays(x, y, z), axis=1),
        np.stack(np.broadcast_arrays(z, after_y, turned_x), axis=1),
        frame,
    )


def _constant(T: Float[Array, "4 4"]) -> Columns:
    return Columns(T[:3, 0:1], T[:3, 1:2], T[:3, 2:3], T[:3, 3:4])


def _turn(
    column: Float[Array, "6 column"],
    axis: Float[Array, "3 _"],
    point: Float[Array, "3 _"],
    p: Float[Array, "3 column"],
) -> None:
    """Fill a column for a turn about `axis` through `point`."""
    arm = p - point
    for out, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        np.multiply(axis[i], arm[j], out=column[out])
        column[out] -= axis[j] * arm[i]
    column[3:] = axis

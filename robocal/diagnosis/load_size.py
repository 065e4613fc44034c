"""How much the loaded parts of an arm may yield: priors in proportion to what they carry.

A gear, a bearing or a pedestal is chosen for its load: large arms are stiffer a newton metre, and
all of them give way by about the same angle under their largest load. So the prior is of that
angle, and the compliance follows from the arm. From joint to joint it is less alike: a wrist's
gear is chosen for what it accelerates too, so that it is stiffer for what it holds. A UR5e's wrist
is rated for 28 Nm and holds 10 Nm, joint 2 is rated for 150 Nm and holds 87 Nm.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array


def compliance_of(angle: float, load: Float[Array, "*_ row"]) -> float:
    """Compliance that turns by an angle [rad] under the largest of the loads [Nm].

    Parameters
    ----------
    angle
        Prior angle under the largest load [rad].
    load
        Torque row by row, or components of a moment [Nm].
    """
    size = np.sqrt(np.square(np.atleast_2d(load)).sum(axis=0))
    return angle / float(size.max())


def joint_compliance_of(angle: float, loads: Float[Array, "joint row"], joint: int) -> float:
    """Compliance of a joint [rad/Nm]: half way between alike in all and alike in angle.

    Parameters
    ----------
    angle
        Prior angle under its largest load of the joint that carries most [rad].
    loads
        Torque of all joints row by row [Nm].
    joint
        From 1.
    """
    largest = np.abs(loads).max(axis=1)
    return angle / float(np.sqrt(largest[joint - 1] * largest.max()))


def weight_of(load: Float[Array, "row"]) -> float:
    """Prior weight of a loaded joint among the others.

    The joints that carry much are the likelier to yield noticeably, yet their gears are larger too:
    half way between all alike and in proportion to the load.

    Parameters
    ----------
    load
        Torque row by row [Nm].
    """
    return float(np.sqrt(np.abs(load).max()))

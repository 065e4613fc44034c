"""How much the loaded parts of an arm may yield: priors in proportion to what they carry.

A gear, a bearing or a pedestal is chosen for its load: large arms are stiffer a newton metre, and
all of them give way by about the same angle under their largest load. So the prior is of that
angle, and the compliance follows from the arm.
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

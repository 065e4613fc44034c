r"""The kinematic model: MDH links, base frame, tool frame, as one parameter vector.

.. math::
   T = S\;T(base)\;M\;\prod_i R_z(\theta_i) T_z(d_i) T_x(a_i) R_x(\alpha_i) R_y(\beta_i)\;F\;T(tool)

Joint i adds its reading to :math:`\theta_i` (revolute) or :math:`d_i` (prismatic). `base` and
`tool` are the free six-parameter frames; `S` (station), `M` (mount) and `F` (flange) are constants,
the identity unless a robot's own description needs them. A fit works on small frame parameters: it
moves the present frame into `S` or `F`, so that no yaw-pitch-roll singularity can be met.
"""

from dataclasses import dataclass, field, replace
from functools import cache, cached_property

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.frames import frame_from_xyz_ypr, invert, own_moves, xyz_ypr_from_frame

LINK_PARAMETERS = ("theta", "d", "a", "alpha", "beta")
FRAME_PARAMETERS = ("x", "y", "z", "yaw", "pitch", "roll")
LINK_IS_ANGLE = (True, False, False, True, True)


def _identity() -> Float[Array, "4 4"]:
    return np.eye(4)


@dataclass(frozen=True)
class KinematicModel:
    """Geometry of one robot in its cell.

    Parameters
    ----------
    links
        One row a link: theta [rad], d [m], a [m], alpha [rad], beta [rad].
    prismatic
        True where the joint moves `d`.
    base
        Robot base in the station frame: x, y, z [m], yaw, pitch, roll [rad].
    tool
        Target in the flange frame, likewise.
    station, mount, flange
        Constant frames before and after `base`, and before `tool`.
    """

    links: Float[Array, "joint 5"]
    prismatic: Bool[Array, "joint"]
    base: Float[Array, "6"] = field(default_factory=lambda: np.zeros(6))
    tool: Float[Array, "6"] = field(default_factory=lambda: np.zeros(6))
    station: Float[Array, "4 4"] = field(default_factory=_identity)
    mount: Float[Array, "4 4"] = field(default_factory=_identity)
    flange: Float[Array, "4 4"] = field(default_factory=_identity)

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return len(self.links)

    @property
    def n_parameters(self) -> int:
        """Length of the parameter vector, 5 n + 12."""
        return 5 * self.n_joints + 12

    @cached_property
    def base_frame(self) -> Float[Array, "4 4"]:
        """Robot base in the measuring frame."""
        return np.asarray(self.station @ frame_from_xyz_ypr(self.base))

    @cached_property
    def tool_frame(self) -> Float[Array, "4 4"]:
        """Target in the frame of the last link."""
        return np.asarray(self.flange @ frame_from_xyz_ypr(self.tool))

    @property
    def vector(self) -> Float[Array, "parameter"]:
        """Parameters in the order of `parameter_names` [m, rad]."""
        return np.concatenate([self.links.ravel(), self.base, self.tool])

    def with_vector(self, vector: Float[Array, "parameter"]) -> "KinematicModel":
        """The same robot with other parameters."""
        n = 5 * self.n_joints
        return replace(
            self,
            links=vector[:n].reshape(-1, 5),
            base=vector[n : n + 6],
            tool=vector[n + 6 : n + 12],
        )

    def with_frames(self, base: Float[Array, "4 4"], tool: Float[Array, "4 4"]) -> "KinematicModel":
        """The same robot with base and tool (as transforms) put into `base` and `tool`."""
        return replace(
            self,
            base=xyz_ypr_from_frame(invert(self.station) @ base),
            tool=xyz_ypr_from_frame(invert(self.flange) @ tool),
        )

    def with_frames_as_origin(self) -> "KinematicModel":
        """The same poses with `base` and `tool` zero: the present frames become constants."""
        return replace(
            self,
            base=np.zeros(6),
            tool=np.zeros(6),
            station=self.base_frame,
            flange=self.tool_frame,
        )

    def covariance_at_origin(
        self, covariance: Float[Array, "unknown unknown"]
    ) -> Float[Array, "unknown unknown"]:
        """The same covariance for the parameters of `with_frames_as_origin`.

        Small moves of base and tool then go along the axes of the present frames. Where two large
        uncertainties cancel, such as heights of base and tool of an upright SCARA arm, a turn of
        1e-4 between the axes matters.

        Parameters
        ----------
        covariance
            Of all parameters of this model, and of whatever else behind them.
        """
        turned = np.eye(len(covariance))
        first = 5 * self.n_joints
        turned[first : first + 6, first : first + 6] = own_moves(self.base)
        turned[first + 6 : first + 12, first + 6 : first + 12] = own_moves(self.tool)
        return np.asarray(turned @ covariance @ turned.T)


@cache
def parameter_names(n_joints: int) -> tuple[str, ...]:
    """Names of the 5 n + 12 parameters: theta_1, d_1, ..., base_x, ..., tool_roll."""
    links = [f"{name}_{joint + 1}" for joint in range(n_joints) for name in LINK_PARAMETERS]
    frames = [f"{frame}_{name}" for frame in ("base", "tool") for name in FRAME_PARAMETERS]
    return (*links, *frames)


def parameter_is_angle(n_joints: int) -> Bool[Array, "parameter"]:
    """True for the parameters in [rad], False for those in [m]."""
    frame = (False, False, False, True, True, True)
    return np.array([*LINK_IS_ANGLE * n_joints, *frame, *frame])

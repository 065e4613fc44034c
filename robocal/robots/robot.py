"""The nominal robot: geometry as its maker states it, joint ranges, link masses."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.kinematics.model import KinematicModel


@dataclass(frozen=True)
class LinkMass:
    """Mass of one link and its centre in the link's own frame."""

    mass: float
    """[kg]"""
    centre: tuple[float, float, float]
    """[m]"""


@dataclass(frozen=True)
class Robot:
    """A robot type.

    Parameters
    ----------
    name
        Type name, `staubli-tx60`.
    geometry
        Nominal kinematics with base and tool at zero.
    limits
        Lower and upper joint reading [rad], [m] for prismatic joints.
    masses
        One a link, or None where the maker does not say.
    """

    name: str
    geometry: KinematicModel
    limits: Float[Array, "joint 2"]
    masses: tuple[LinkMass, ...] | None = None

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return self.geometry.n_joints

    @property
    def joint_units(self) -> tuple[str, ...]:
        """`deg` or `mm` for every joint, as column names end."""
        return tuple("mm" if slides else "deg" for slides in self.geometry.prismatic)

    @property
    def joint_scale(self) -> Float[Array, "joint"]:
        """SI units in one file unit of every joint: pi/180 or 0.001."""
        return np.where(self.geometry.prismatic, 1e-3, np.pi / 180.0)

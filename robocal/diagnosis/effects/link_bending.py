"""A link bends under its load, as a cantilever.

With the tip's load F across a link of length L (its a) the end turns by phi = L F L / (2 EI) and
shifts by two thirds of L phi: two thirds of the turn act at the start of the link, one third at
its end. The load is the weight of payload and of the links behind it. In the plane of gravity this
turns much as the next joint yielding does; only loads across the plane tell the two apart.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Coefficient, Instance, Moves, column, theta
from robocal.kinematics.forward import walk
from robocal.kinematics.model import KinematicModel

PRIOR = 2.5e-6
"""1 to 6 microradian a newton metre of the load's moment about the link's start [rad/Nm]"""
_SHORTEST = 0.1
"""Links shorter than this are stiff [m]"""


class LinkBending:
    """A link bends under its load."""

    name = "link_bending"
    advice = "reduce the load; compensate with this model: the link itself cannot be adjusted"
    needs = "link masses in robot.yaml, or payload_kg"

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every long link that is followed by another joint."""
        if rows.robot.masses is None and not rows.has_payload:
            return []
        lengths = np.abs(rows.robot.geometry.links[:, 2])
        coefficient = Coefficient("bending_rad_per_nm", PRIOR)
        return [
            Instance(self.name, joint, (), (coefficient,))
            for joint in range(1, rows.n_joints)
            if lengths[joint - 1] > _SHORTEST
        ]

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Turns about the link's y (bending along z) and about its z (bending along y)."""
        assert instance.joint is not None
        link = instance.joint - 1
        about_y, about_z = self._moments(rows, link)
        alpha = rows.robot.geometry.links[link, 3]
        following = theta(instance.joint + 1, rows)
        # In the axes after alpha the turn about y is y cos - z sin, the one about z y sin + z cos.
        turn_y, turn_z = about_y, about_z / 3.0
        beta = turn_y * np.cos(alpha) + turn_z * np.sin(alpha)
        next_theta = turn_z * np.cos(alpha) - turn_y * np.sin(alpha)
        a = rows.robot.geometry.links[link, 2]
        return {
            5 * link: column(about_z * 2.0 / 3.0),
            5 * link + 1: column(-about_y * 2.0 / 3.0 * a),
            5 * link + 4: column(beta),
            following: column(next_theta),
        }

    def _moments(
        self, rows: Circumstances, link: int
    ) -> tuple[Float[Array, "row"], Float[Array, "row"]]:
        """Moments of the weight behind the link about its y and z axes before alpha [Nm]."""
        geometry = rows.robot.geometry
        part = KinematicModel(
            geometry.links[: link + 1], geometry.prismatic[: link + 1], mount=geometry.mount
        )
        _, joints = walk(part, rows.joints[:, : link + 1])
        here = joints[-1]
        x, z = here.x, here.z
        y = np.cross(z, x, axis=0)
        moment = rows.moment_about(here.before, behind=link)
        return np.asarray((moment * y).sum(axis=0)), np.asarray((moment * z).sum(axis=0))

"""A link bends under its load, as a cantilever.

Force F and moment M of the weight behind the link act at its tip, both across its direction e; with
its length L (its a) the tip turns by (L M + L^2/2 e x F) / EI and shifts by
(L^2/2 M x e + L^3/3 F) / EI [1]_. The coefficient is L / EI. In the plane of gravity this turns
much as the next joint yielding does; only loads across the plane tell the two apart.

No link is a beam of one section. The force's own moment grows towards the root: the slenderer the
tip, the less it counts. A form with the end moment alone is offered too, `end_force_share` 0.

References
----------
.. [1] S. Timoshenko, *Strength of Materials*, part I, chapter V: Euler and Bernoulli's beam.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Coefficient, Follows, Instance, Moves, column, theta
from robocal.diagnosis.load_size import compliance_of
from robocal.kinematics.forward import walk
from robocal.kinematics.model import KinematicModel

YIELD = 3e-4
"""Of the tip under its largest load [rad]"""
END_FORCE_SHARES = (1.0, 0.0)
"""How much of the tip's force counts in each form; a beam of one section first; [1]"""
_SHARE = "end_force_share"
_SHORTEST = 0.1
"""Links shorter than this are stiff [m]"""


class LinkBending:
    """A link bends under its load."""

    name = "link_bending"
    follows = Follows.load
    advice = "reduce the load; compensate with this model: the link itself cannot be adjusted"
    needs = "link masses in robot.yaml, or payload_kg, varying"

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every long link that is followed by another joint."""
        if rows.robot.masses is None and not rows.has_payload:
            return []
        lengths = np.abs(rows.robot.geometry.links[:, 2])
        joints = [j for j in range(1, rows.n_joints) if lengths[j - 1] > _SHORTEST]
        forms = [(joint, share) for joint in joints for share in END_FORCE_SHARES]
        loads = [self._turning(rows, joint - 1, share) for joint, share in forms]
        return [
            Instance(
                self.name,
                joint,
                () if share == 1.0 else ((_SHARE, share),),
                (Coefficient("bending_rad_per_nm", compliance_of(YIELD, load)),),
            )
            for (joint, share), load in zip(forms, loads, strict=True)
            if load.any()
        ]

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Turns of the link's tip about its y and z, and its shifts along them."""
        assert instance.joint is not None
        link = instance.joint - 1
        _, _, a, alpha, _ = rows.robot.geometry.links[link]
        share = dict(instance.arguments).get(_SHARE, 1.0)
        force, moment = self._loads(rows, link, share)
        turn_y, turn_z = self._turning(rows, link, share)
        shift_y = a / 2.0 * moment[2] + a**2 / 3.0 * force[1]
        shift_z = -a / 2.0 * moment[1] + a**2 / 3.0 * force[2]
        # A turn at the link's start brings the shift along y and a part of the turn.
        start = shift_y / a
        turn_z = turn_z - start
        # In the axes after alpha the turn about y is y cos - z sin, the one about z y sin + z cos.
        beta = turn_y * np.cos(alpha) + turn_z * np.sin(alpha)
        following = turn_z * np.cos(alpha) - turn_y * np.sin(alpha)
        return {
            5 * link: column(start),
            5 * link + 1: column(shift_z),
            5 * link + 4: column(beta),
            theta(instance.joint + 1, rows): column(following),
        }

    def _turning(self, rows: Circumstances, link: int, share: float) -> Float[Array, "2 row"]:
        """Moment that, alone, would turn the tip as force and moment together do [Nm]."""
        a = rows.robot.geometry.links[link, 2]
        force, moment = self._loads(rows, link, share)
        return np.stack([moment[1] - a / 2.0 * force[2], moment[2] + a / 2.0 * force[1]])

    def _loads(
        self, rows: Circumstances, link: int, share: float
    ) -> tuple[Float[Array, "3 row"], Float[Array, "3 row"]]:
        """Force that counts [N] and moment [Nm] of the weight at the link's tip, before alpha."""
        geometry = rows.robot.geometry
        part = KinematicModel(
            geometry.links[: link + 1], geometry.prismatic[: link + 1], mount=geometry.mount
        )
        last, joints = walk(part, rows.joints[:, : link + 1])
        x, z = joints[-1].x, joints[-1].z
        axes = (x, np.cross(z, x, axis=0), z)
        moment = rows.moment_about(last.p, behind=link)
        force = share * rows.weight_behind(link)
        return (
            np.stack([(force * axis).sum(axis=0) for axis in axes]),
            np.stack([(moment * axis).sum(axis=0) for axis in axes]),
        )

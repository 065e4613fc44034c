"""Periodic transmission or encoder error of a joint.

delta q_j = A cos(k q_j) + B sin(k q_j), with the order k in cycles a turn: 1 and 2 for eccentric
gears and encoders, twice the ratio for a strain wave gear. Orders are searched, not listed; see
`order_sweep.py`.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Coefficient, Follows, Instance, Moves, revolute_joints, theta

PRIOR_LOW = 3e-4
"""Amplitude at orders up to `LOW_ORDER` [rad]"""
PRIOR_HIGH = 1e-4
"""Amplitude above [rad]"""
LOW_ORDER = 3.0


class GearHarmonic:
    """Periodic transmission or encoder error."""

    name = "gear_harmonic"
    follows = Follows.angle
    advice = (
        "check gearbox and encoder of this joint (order 1 or 2: eccentricity; twice the "
        "gear ratio: "
        "the strain wave gear's own); compensate with this model"
    )
    needs = ""

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Orders one and two of every joint; the others are searched."""
        return [self.at(joint, order) for joint in revolute_joints(rows) for order in (1.0, 2.0)]

    def at(self, joint: int, order: float) -> Instance:
        """The instance of a joint and order."""
        prior = float(self.prior_at(np.array([order]))[0])
        coefficients = (Coefficient("cosine_rad", prior), Coefficient("sine_rad", prior))
        return Instance(self.name, joint, (("order", order),), coefficients)

    def prior_at(self, orders: Float[Array, "order"]) -> Float[Array, "order"]:
        """Standard deviation of both coefficients at these orders [rad]."""
        return np.where(orders <= LOW_ORDER, PRIOR_LOW, PRIOR_HIGH)

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Cosine and sine of the order times the reading."""
        assert instance.joint is not None
        phase = instance.argument("order") * rows.joints[:, instance.joint - 1]
        return {theta(instance.joint, rows): np.stack([np.cos(phase), np.sin(phase)], axis=1)}

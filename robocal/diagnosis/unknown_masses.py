"""Gravity of links whose masses nobody states: unit masses at the ends of the long links.

A mass anywhere on a straight link loads the joints as two masses at its ends do; so what a joint
yields is linear in one unknown number an end, stiffness times mass.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.circumstances import TIP, Circumstances
from robocal.diagnosis.effect import Coefficient

TYPICAL_MASS = 5.0
"""Of a link of a small arm [kg]"""


def torques_of_unit_masses(rows: Circumstances, joint: int) -> dict[str, Float[Array, "row"]]:
    """Gravity torque about a joint (from 1) of one kilogram at each point behind it [Nm]."""
    return {
        name: rows.torque_of(joint - 1, 1.0, point)
        for name, point in rows.mass_places.items()
        if name == TIP or int(name) >= joint
    }


def unit_mass_coefficients(
    quantity: str, prior: float, loads: dict[str, Array], least: float
) -> tuple[Coefficient, ...]:
    """One coefficient a point whose load varies: `quantity` times the mass there."""
    return tuple(
        Coefficient(f"{quantity}_times_mass_{name}_rad_kg_per_nm", prior * TYPICAL_MASS)
        for name, load in loads.items()
        if np.ptp(load) > least
    )


def point_of(coefficient: Coefficient) -> str:
    """The point whose mass a coefficient holds; empty where it holds none."""
    _, _, rest = coefficient.name.partition("_times_mass_")
    return rest.partition("_")[0]

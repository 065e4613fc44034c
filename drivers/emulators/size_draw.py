"""How large each hidden effect is and where it acts, drawn from a seed.

Sizes are log-uniform over ranges of real arms; compliances, which were collected on a small arm,
are scaled by the torque that this arm carries. The other form of an effect differs from the plain
one in ways of real machines: springs harden, neighbouring harmonics join, drifts die away, links
expand unevenly, play changes with the angle.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivers.emulators.campaign_draw import RISE_K
from drivers.emulators.records import WorldError
from drivers.emulators.true_arm import LinkTable, Vector

Entries = dict[str, Any]
"""An effect in its JSON form, without its name."""

SMALL_ARM_TORQUE = 106.0
"""Largest torque about joint 2 of the arm that the compliances were collected on [N m]."""
SMALL_ARM_PAYLOAD_TORQUE = 30.0
"""That of 4 kg [N m]."""
LONG_LINK = 0.15
"""A link must be as long, across its joint's axis, to bend [m]."""
LEAST_LOAD = 0.05
"""A joint counts as loaded if its largest torque is so much of the arm's largest; [1]"""


@dataclass(frozen=True)
class Scene:
    """What a draw must know of the campaign."""

    draw: np.random.Generator
    table: LinkTable
    loads: Vector
    """Largest gravity torque of every joint in the campaign [N m]."""
    payload_loads: Vector
    reversing: tuple[int, ...]
    """Joints, from 1, whose torque changes sign."""
    duration_s: float
    size: float
    """Factor on every size."""
    other_form: bool

    def between(self, low: float, high: float) -> float:
        """Draw a size log-uniformly."""
        return self.size * math.exp(self.draw.uniform(math.log(low), math.log(high)))

    def bent(self, value: float, plain: float = 0.0) -> float:
        """Return `value` where the form is the other one, else `plain`."""
        return value if self.other_form else plain

    def any_joint(self) -> int:
        """Draw a joint."""
        return int(self.draw.integers(1, self.table.n_joints + 1))

    def turning_joint(self) -> int:
        """Draw a revolute joint."""
        turning = [j + 1 for j, slides in enumerate(self.table.prismatic) if not slides]
        return int(self.draw.choice(turning))

    def loaded_joint(self, loads: Vector) -> int:
        """Draw a joint that carries something, the proximal ones more often."""
        able = [j for j in range(self.table.n_joints) if loads[j] > LEAST_LOAD * loads.max()]
        weight = np.sqrt(loads[able])
        return int(self.draw.choice(able, p=weight / weight.sum())) + 1

    def direction(self, length: float) -> list[float]:
        """Draw a vector of this length."""
        v = self.draw.normal(size=3)
        return [float(x) for x in v / np.linalg.norm(v) * length]

    def phase(self) -> float:
        """Draw a phase [deg]."""
        return float(self.draw.uniform(-180.0, 180.0))

    def moment(self) -> float:
        """Draw a world time within the campaign [s]."""
        return float(self.draw.uniform(0.12, 0.88)) * self.duration_s


def _yielding(scene: Scene, loads: Vector, reference: float, low: float, high: float) -> Entries:
    joint = scene.loaded_joint(loads)
    largest = float(loads[joint - 1])
    # The softer the joint the smaller it is: between equal stiffness and equal deflection.
    scale = reference / math.sqrt(largest * float(loads.max()))
    return {
        "joint": joint,
        "compliance_rad_per_nm": scene.between(low, high) * scale,
        "hardening_nm": scene.bent(largest, math.inf),
    }


def joint_compliance(scene: Scene) -> Entries:
    """3 to 30 microradian a newton metre at joint 2 of a small arm."""
    return _yielding(scene, scene.loads, SMALL_ARM_TORQUE, 3e-6, 30e-6)


def payload_compliance(scene: Scene) -> Entries:
    """6 to 60 microradian a newton metre."""
    return _yielding(scene, scene.payload_loads, SMALL_ARM_PAYLOAD_TORQUE, 6e-6, 60e-6)


def link_bending(scene: Scene) -> Entries:
    """1 to 6 microradian a newton metre."""
    able = [int(j) + 1 for j in np.flatnonzero(np.abs(scene.table.a) > LONG_LINK)]
    return {
        "joint": int(scene.draw.choice(able)),
        "compliance_rad_per_nm": scene.between(1e-6, 6e-6) * _torque_scale(scene),
        "flat_share": scene.bent(1.5, 1.0),
    }


def _torque_scale(scene: Scene) -> float:
    return SMALL_ARM_TORQUE / float(scene.loads.max())


def base_compliance(scene: Scene) -> Entries:
    """1 to 10 microradian a newton metre."""
    return {
        "compliance_rad_per_nm": scene.between(1e-6, 10e-6) * _torque_scale(scene),
        "y_share": scene.bent(0.65, 1.0),
    }


def gear_harmonic(scene: Scene) -> Entries:
    """Once, twice a turn, or at a gear's own order: twice a strain wave ratio, or a cycloid's."""
    kind = scene.draw.random()
    if kind < 0.35:
        order, amplitude = 1.0, scene.between(0.1, 1.0)
    elif kind < 0.55:
        order, amplitude = 2.0, scene.between(0.05, 0.5)
    else:
        ratio = float(scene.draw.choice([50, 80, 100, 101, 120, 160]))
        own = float(scene.draw.uniform(5.0, 60.0))
        order = 2.0 * ratio if scene.draw.random() < 0.6 else own
        amplitude = scene.between(0.05, 0.3)
    return {
        "joint": scene.turning_joint(),
        "order": order,
        "amplitude_mrad": amplitude,
        "phase_deg": scene.phase(),
        "neighbour_order": order + 1.0 if order <= 2.0 else 0.5 * order,
        "neighbour_share": scene.bent(0.25),
    }


def encoder_gain(scene: Scene) -> Entries:
    """50 to 500 parts in a million."""
    sign = float(scene.draw.choice([-1.0, 1.0]))
    return {
        "joint": scene.any_joint(),
        "gain_ppm": sign * scene.between(50.0, 500.0),
        "unevenness_per_rad": scene.bent(0.1),
    }


def joint_coupling(scene: Scene) -> Entries:
    """Between wrist joints, or from joint 2 to joint 3: 0.2 to 2 mrad a radian."""
    n = scene.table.n_joints
    pairs = [(n, n - 1), (n, n - 2), (n - 1, n - 2), (3, 2)]
    joint, driver = pairs[int(scene.draw.integers(len(pairs)))]
    sign = float(scene.draw.choice([-1.0, 1.0]))
    return {
        "joint": joint,
        "driven_by": driver,
        "coupling_mrad_per_rad": sign * scene.between(0.2, 2.0),
        "ripple": scene.bent(0.25),
    }


def backlash(scene: Scene) -> Entries:
    """0.05 to 0.5 mrad."""
    width = scene.between(0.05, 0.5)
    return {"joint": scene.any_joint(), "width_mrad": width, "uneven_share": scene.bent(0.4)}


def load_backlash(scene: Scene) -> Entries:
    """0.1 to 0.6 mrad, at a joint whose load changes side."""
    if not scene.reversing:
        raise WorldError("config", "no joint's load changes side; hide another effect.")
    joint = int(scene.draw.choice(scene.reversing))
    return {
        "joint": joint,
        "width_mrad": scene.between(0.1, 0.6),
        "smooth_nm": scene.bent(0.15 * float(scene.loads[joint - 1])),
    }


def settling(scene: Scene) -> Entries:
    """20 to 300 parts in a million of the last move."""
    rest = scene.between(20.0, 300.0)
    return {"joint": scene.any_joint(), "rest_ppm": rest}


def thermal_expansion(scene: Scene) -> Entries:
    """Aluminium, half to one and a half of it."""
    cte = 23.0 * scene.size * float(scene.draw.uniform(0.5, 1.5))
    return {"cte_ppm_per_k": cte, "link_shares": _link_shares(scene)}


def _link_shares(scene: Scene) -> list[float]:
    if not scene.other_form:
        return []
    return [float(s) for s in 1.0 + scene.draw.uniform(-0.4, 0.4, scene.table.n_joints)]


def joint_thermal_drift(scene: Scene) -> Entries:
    """30 to 300 microradian over the whole rise."""
    return {
        "joint": scene.any_joint(),
        "drift_urad_per_k": scene.between(30.0, 300.0) / RISE_K,
        "bend_per_k": scene.bent(0.4 / RISE_K),
    }


def warm_up(scene: Scene) -> Entries:
    """As much as the thermal expansion, in a quarter to all of the campaign."""
    growth = 23.0 * RISE_K * scene.size * float(scene.draw.uniform(0.5, 1.5))
    return {
        "growth_ppm": growth,
        "time_constant_s": float(scene.draw.uniform(0.15, 0.8)) * scene.duration_s,
        "link_shares": _link_shares(scene),
    }


def base_drift(scene: Scene) -> Entries:
    """0.05 to 0.4 mm over the campaign."""
    way = scene.direction(scene.between(0.05, 0.4))
    hours = scene.duration_s / 3600.0
    slow = scene.bent(0.5 * scene.duration_s, math.inf)
    share = -slow * math.expm1(-scene.duration_s / slow) / 3600.0 if scene.other_form else hours
    return {"rate_mm_per_h": [v / share for v in way], "time_constant_s": slow}


def base_step(scene: Scene) -> Entries:
    """0.05 to 0.5 mm."""
    return {"step_mm": scene.direction(scene.between(0.05, 0.5)), **_moment(scene)}


def tool_step(scene: Scene) -> Entries:
    """0.05 to 0.5 mm."""
    return {"step_mm": scene.direction(scene.between(0.05, 0.5)), **_moment(scene)}


def encoder_step(scene: Scene) -> Entries:
    """0.05 to 0.5 mrad."""
    sign = float(scene.draw.choice([-1.0, 1.0]))
    step = sign * scene.between(0.05, 0.5)
    return {"joint": scene.any_joint(), "step_mrad": step, **_moment(scene)}


def _moment(scene: Scene) -> Entries:
    return {"at_s": scene.moment(), "creep_s": scene.bent(0.04 * scene.duration_s)}


def instrument_scale(scene: Scene) -> Entries:
    """2 to 20 parts in a million."""
    return {"scale_ppm": scene.between(2.0, 20.0)}


def instrument_angle(scene: Scene) -> Entries:
    """5 to 40 microradian."""
    return {
        "azimuth_urad": scene.between(5.0, 40.0),
        "azimuth_phase_deg": scene.phase(),
        "elevation_urad": scene.between(5.0, 40.0),
        "elevation_phase_deg": scene.phase(),
        "third_share": scene.bent(0.25),
    }


SIZES: dict[str, Callable[[Scene], Entries]] = {
    draw.__name__: draw
    for draw in (
        joint_compliance,
        payload_compliance,
        link_bending,
        base_compliance,
        gear_harmonic,
        encoder_gain,
        joint_coupling,
        backlash,
        load_backlash,
        settling,
        thermal_expansion,
        joint_thermal_drift,
        warm_up,
        base_drift,
        base_step,
        tool_step,
        encoder_step,
        instrument_scale,
        instrument_angle,
    )
}

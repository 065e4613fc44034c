"""What residuals are drawn over: each covariate of the rows, in units that a person reads."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import revolute_joints
from robocal.diagnosis.effects.joint_compliance import LEAST_TORQUE

_DEG = np.pi / 180.0
_LEAST_SPREAD = 1e-9
"""A covariate that varies less does not vary; in its own unit."""

Covariates = dict[str, Float[Array, "row"]]
"""By name with its unit; NaN where a row does not say."""


def covariates_of(rows: Circumstances) -> Covariates:
    """Every covariate that is known and varies: joint by joint, then of the whole arm."""
    known = {
        **_of_joints(rows),
        "time [min]": rows.time / 60.0 if rows.timed else np.full(len(rows), np.nan),
        "temperature [degC]": rows.temperature,
        "payload [kg]": rows.payload,
        "speed [share of full]": rows.speed,
        "settling time [s]": rows.settle,
        "reach [mm]": rows.reach * 1e3,
        **_of_tool(rows),
    }
    return {name: values for name, values in known.items() if _spread(values) > _LEAST_SPREAD}


def _spread(values: Float[Array, "row"]) -> float:
    finite = values[np.isfinite(values)]
    return float(np.ptp(finite)) if len(finite) else 0.0


def _of_joints(rows: Circumstances) -> Covariates:
    """Readings, torques, directions of approach and last moves."""
    scale, units = rows.robot.joint_scale, rows.robot.joint_units
    readings, moves = rows.joints / scale, (rows.joints - rows.previous) / scale
    found = {f"joint {j} [{unit}]": readings[:, j - 1] for j, unit in enumerate(units, 1)}
    name, torque = _torque(rows)
    found |= {
        name.format(joint): torque[joint - 1]
        for joint in revolute_joints(rows)
        if np.ptp(torque[joint - 1]) > LEAST_TORQUE
    }
    found |= {f"approach {j}": rows.approach[:, j - 1] for j in range(1, rows.n_joints + 1)}
    return found | {f"move {j} [{unit}]": moves[:, j - 1] for j, unit in enumerate(units, 1)}


def _torque(rows: Circumstances) -> tuple[str, Float[Array, "joint row"]]:
    """Torque of gravity about every joint and its name: of all that is known, or of 1 kg."""
    if rows.robot.masses is not None:
        return "torque {} [N·m]", rows.torque
    if rows.has_payload:
        return "load torque {} [N·m]", rows.payload_torque
    of_one_kg = [rows.torque_of(joint, 1.0, rows.hand) for joint in range(rows.n_joints)]
    return "torque {} [N·m/kg]", np.stack(of_one_kg)


def _of_tool(rows: Circumstances) -> Covariates:
    """Orientation of the tool to gravity, to the base and to the instrument's beam."""
    x, _, z = rows.tool_axes
    beam = rows.base_rotation.T @ rows.position.T
    beam[:, ~rows.position.any(axis=1)] = np.nan
    return {
        "tool tilt [deg]": _angle(z, rows.gravity[:, None]),
        "tool heading [deg]": np.arctan2(x[1], x[0]) / _DEG,
        "tool to beam [deg]": _angle(z, beam),
    }


def _angle(one: Float[Array, "3 row"], other: Float[Array, "3 _"]) -> Float[Array, "row"]:
    """Between directions, exact near zero too [deg]."""
    across = np.linalg.norm(np.cross(one, other, axis=0), axis=0)
    return np.asarray(np.arctan2(across, (one * other).sum(axis=0)) / _DEG)

"""The campaign that every program fits: a UR10 that is not what its data sheet says.

The truth is the nominal table with an error on all 24 parameters of Craig's chain, the product of
Rx(alpha) Tx(a) Rz(theta + q) Tz(d). In robocal's terms alpha and a of the first link are roll and x
of the base. Poses of a reflector are measured at joints drawn evenly; 500 more without noise judge.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from robocal.frames import frame_from_xyz_ypr
from robocal.kinematics.forward import forward_kinematics
from robocal.kinematics.model import KinematicModel, parameter_is_angle, parameter_names
from robocal.robots.library import load_robot

ROBOT = "ur10"
LENGTH_ERROR = 0.5e-3
"""Of d and a, one standard deviation [m]"""
ANGLE_ERROR = float(np.radians(0.05))
"""Of theta and alpha, likewise [rad]"""
TOOL = (0.060, 0.025, 0.130)
"""Reflector in the flange [m]"""
STATION = (1.9, -1.1, 0.6, 2.2, 0.1, -0.2)
"""Robot base in the tracker where the frames are unknown: x, y, z [m], yaw, pitch, roll [rad]"""
POSITION_STD = 0.02e-3
"""[m]"""
ORIENTATION_STD = float(np.radians(0.005))
"""[rad]"""
N_HELD_OUT = 500

_LAST_OF_LINK_6 = ("a_6", "alpha_6")
CHAIN = frozenset(
    name
    for name in parameter_names(6)
    if name.startswith(("theta_", "d_", "a_", "alpha_")) and name not in _LAST_OF_LINK_6
) | {"base_x", "base_roll"}
"""The 24 parameters"""


@dataclass(frozen=True)
class Campaign:
    """What was measured, and what would have been measured without noise elsewhere."""

    nominal: KinematicModel
    """With its tool; the base is at `station`."""
    joints: np.ndarray
    T: np.ndarray
    """Measured poses of the target (row, 4, 4)."""
    held_out_joints: np.ndarray
    held_out: np.ndarray
    """True positions [m]"""

    def errors(self, position: np.ndarray) -> tuple[float, float]:
        """Mean and largest distance of predicted held-out positions from the truth [m]."""
        away = np.linalg.norm(position - self.held_out, axis=1)
        return float(away.mean()), float(away.max())

    def save(self, path: Path) -> None:
        """As arrays that a peer's program reads; angles of theta are zero in the nominal table."""
        theta, d, a, alpha, _ = self.nominal.links.T
        np.savez(
            path,
            craig=np.column_stack([[0.0, *alpha[:-1]], [0.0, *a[:-1]], theta, d]),
            tool=np.array(TOOL),
            joints=self.joints,
            T=self.T,
            held_out_joints=self.held_out_joints,
            position_std=POSITION_STD,
            orientation_std=ORIENTATION_STD,
        )


def campaign(rows: int, *, frames_known: bool = True, seed: int = 1) -> Campaign:
    """A campaign of so many rows, the same for every program."""
    rng = np.random.default_rng(seed)
    geometry = load_robot(ROBOT).geometry
    station = np.eye(4) if frames_known else frame_from_xyz_ypr(np.array(STATION))
    nominal = replace(geometry, tool=np.array([*TOOL, 0.0, 0.0, 0.0]), station=station)
    wrong = np.isin(parameter_names(6), list(CHAIN))
    size = np.where(parameter_is_angle(6), ANGLE_ERROR, LENGTH_ERROR)
    true = nominal.with_vector(nominal.vector + rng.normal(size=len(wrong)) * size * wrong)
    held_out_joints = rng.uniform(-np.pi, np.pi, (N_HELD_OUT, 6))
    joints = rng.uniform(-np.pi, np.pi, (rows, 6))
    T = forward_kinematics(true, joints)
    T[:, :3, 3] += rng.normal(size=(rows, 3)) * POSITION_STD
    turns = rng.normal(size=(rows, 3)) * ORIENTATION_STD
    small = np.stack([frame_from_xyz_ypr(np.array([0, 0, 0, *turn]))[:3, :3] for turn in turns])
    T[:, :3, :3] = small @ T[:, :3, :3]
    held_out = forward_kinematics(true, held_out_joints)[:, :3, 3]
    return Campaign(nominal, joints, T, held_out_joints, held_out)

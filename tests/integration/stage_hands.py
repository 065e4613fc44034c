"""An emulated stage for tests, and where its cups must be by elementary geometry."""

import numpy as np
from scipy.spatial.transform import Rotation


def frame(entry: dict) -> np.ndarray:
    """Trans(x, y, z) Rz(yaw) Ry(pitch) Rx(roll), translation in m."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("ZYX", entry["ypr_deg"], degrees=True).as_matrix()
    T[:3, 3] = np.array(entry["xyz_mm"]) * 1e-3
    return T


def cup_in_master(truth: dict, cup: str) -> np.ndarray:
    """Where a sound stage has its cup at the state that the truth tells."""
    state, stage = truth["state"], frame(truth["stage"])
    local = np.array([state["slide"], 0.0, 0.0])
    if cup == "rod":
        swing = Rotation.from_rotvec([0, 0, -state["rod_angle"]])
        local = local + state["rod_length"] * swing.apply([-1.0, 0.0, 0.0])
    return stage[:3, :3] @ local + stage[:3, 3]


def in_slave(truth: dict, point: np.ndarray) -> np.ndarray:
    """A point of the master's base, in the slave's."""
    base = frame(truth["slave_base"])
    return base[:3, :3].T @ (point - base[:3, 3])


def placed(next_touch: dict) -> dict[str, float]:
    """How a person sets the stage for a touch that the service asks for."""
    fields = ("slide_mm", "rod_angle_deg", "rod_length_mm")
    return {field: next_touch[field] for field in fields if next_touch[field] is not None}

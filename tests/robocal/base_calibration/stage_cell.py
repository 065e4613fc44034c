"""A true cell for the tests: stage, cups and readings by elementary geometry of its own."""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from robocal.base_calibration.stage import Readings
from robocal.base_calibration.touches import Touches


@dataclass
class Faults:
    """What the true stage gets wrong, and which touch slips."""

    angle_zero: float = 0.0
    rod_zero: float = 0.0
    rod_scale: float = 0.0
    slide_scale: float = 0.0
    squareness: float = 0.0
    abbe_pitch: float = 0.0
    abbe_yaw: float = 0.0
    sag: float = 0.0
    slips: dict[int, tuple[float, float, float]] = field(default_factory=dict)


@dataclass
class Cell:
    """Master at the origin; the stage's frames and the slave's base as given."""

    stages: list[np.ndarray]
    slave: np.ndarray
    sigma_tip: float = 0.05e-3
    sigma_slide: float = 0.05e-3
    sigma_rod: float = 0.02e-3
    sigma_angle: float = 0.1e-3


@dataclass
class Plan:
    """Where each touch is made."""

    by_slave: np.ndarray
    on_rod: np.ndarray
    slide: np.ndarray
    angle: np.ndarray
    length: np.ndarray
    placement: np.ndarray

    @staticmethod
    def of(rows: list[tuple]) -> "Plan":
        """Rows of (slave?, rod?, slide, angle, length[, placement])."""
        full = [(*row, 0) if len(row) == 5 else row for row in rows]
        slave, rod, s, a, length, k = (np.array(column) for column in zip(*full, strict=True))
        return Plan(slave.astype(bool), rod.astype(bool), s * 1.0, a * 1.0, length * 1.0, k)


def frame(xyz, vector) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(vector).as_matrix()
    T[:3, 3] = xyz
    return T


def true_cups(cell: Cell, plan: Plan, faults: Faults) -> np.ndarray:
    """True places of the touched cups in the master's base, when the sensors read as planned."""
    points = []
    longest = plan.length[plan.on_rod].max() if plan.on_rod.any() else 1.0
    for rod, s, angle, length, k in zip(
        plan.on_rod, plan.slide, plan.angle, plan.length, plan.placement, strict=True
    ):
        R = cell.stages[k][:3, :3]
        point = cell.stages[k][:3, 3] + R[:, 0] * s * (1 + faults.slide_scale)
        if rod:
            at_zero = np.array([-1.0, 0.0, 0.0])
            swing = Rotation.from_rotvec([0, 0, -(angle + faults.angle_zero)])
            tilt = Rotation.from_rotvec([0, faults.squareness + faults.abbe_pitch * s, 0])
            yaw = Rotation.from_rotvec([0, 0, faults.abbe_yaw * s])
            d = R @ (yaw * tilt * swing).apply(at_zero)
            point = point + d * (length * (1 + faults.rod_scale) + faults.rod_zero)
            down = np.array([0.0, 0.0, -1.0])
            point = point + faults.sag * (length / longest) ** 4 * (down - d * (down @ d))
        points.append(point)
    return np.array(points)


def simulate(cell: Cell, plan: Plan, faults: Faults, rng: np.random.Generator) -> Touches:
    """Touches with noise on tips and readings."""
    points = true_cups(cell, plan, faults)
    inverse = np.linalg.inv(cell.slave)
    tips = np.where(plan.by_slave[:, None], points @ inverse[:3, :3].T + inverse[:3, 3], points)
    n = len(points)
    tips = tips + cell.sigma_tip * rng.normal(size=(n, 3))
    for touch, slip in faults.slips.items():
        tips[touch] += slip
    poses = np.tile(np.eye(4), (n, 1, 1))
    poses[:, :3, 3] = tips
    return Touches(
        lines=np.arange(1, n + 1),
        by_slave=plan.by_slave,
        on_rod=plan.on_rod,
        placement=plan.placement,
        readings=Readings(
            plan.slide + cell.sigma_slide * rng.normal(size=n),
            np.where(plan.on_rod, plan.angle + cell.sigma_angle * rng.normal(size=n), 0.0),
            np.where(plan.on_rod, plan.length + cell.sigma_rod * rng.normal(size=n), 0.0),
        ),
        needle_poses=poses,
        tip_covariance=np.eye(3 * n) * cell.sigma_tip**2,
    )


def wide_plan() -> Plan:
    """Fifteen touches each: three slide positions, both cups, rod lengths one to two."""
    rows = []
    for slave in (0, 1):
        for slide in (0.0, 0.25, 0.5):
            rows.append((slave, 0, 1.4 * slave + slide, 0.0, 0.0))
            for angle, length in ((0.0, 0.4), (0.9, 0.8), (-0.9, 0.6), (1.4, 0.4)):
                rows.append((slave, 1, 1.4 * slave + slide, angle, length))
    return Plan.of(rows)


def short_plan() -> Plan:
    """The paper's four touches: P1, P2, R1, R2."""
    return Plan.of([
        (0, 1, 0.0, 0.0, 0.5),
        (0, 0, 0.0, 0.0, 0.0),
        (1, 1, 1.5, 0.6, 0.6),
        (1, 1, 1.5, -0.4, 0.8),
    ])


LEVEL_CELL = Cell([frame([0.6, 0.8, 0.4], [0, 0, -1.5])], frame([2.2, -0.3, 0.05], [0, 0, 2.0]))
TILTED_CELL = Cell(
    [frame([0.6, 0.8, 0.4], [0.2, -0.1, -1.5])], frame([2.2, -0.3, 0.05], [0.4, 0.2, 2.0])
)


def within_prior(prior_std: np.ndarray, rng: np.random.Generator) -> dict[str, float]:
    """Sensor corrections of a sound stage, one draw."""
    names = [name for name in Faults.__dataclass_fields__ if name != "slips"]
    return dict(zip(names, prior_std * rng.normal(size=len(names)), strict=True))

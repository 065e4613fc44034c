"""Campaigns measured on robots off their nominal geometry, and the slips that spoil them.

Every kind of slip changes a table of numbers in file units, as a person or a program would. Nothing
of robocal is used.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from tests.elementary_kinematics import ROBOTS, Arm, arm_from_document, random_frame

SEVEN = [  # theta, d, a, alpha of a seven-joint arm with spherical shoulder and wrist
    (0, 340, 0, -90), (0, 0, 0, 90), (0, 400, 0, 90), (0, 0, 0, -90),
    (0, 400, 0, -90), (0, 0, 0, 90), (0, 126, 0, 0),
]  # fmt: skip
NAMES = ("ur10e", "ur5e", "staubli_tx60", "abb_irb120", "seven", "abb_irb910sc")


def robot_text(name: str) -> str:
    """Its robot.yaml."""
    if name != "seven":
        return (ROBOTS / f"{name}.yaml").read_text()
    joints = [
        {"type": "revolute", "theta_deg": t, "d_mm": d, "a_mm": a, "alpha_deg": alpha,
         "beta_deg": 0, "limits_deg": [-170, 170]}
        for t, d, a, alpha in SEVEN
    ]  # fmt: skip
    return yaml.safe_dump({"name": "seven", "convention": "mdh", "joints": joints})


@dataclass(frozen=True)
class Table:
    """Columns of measurements.csv in file units."""

    arm: Arm
    joints: np.ndarray
    position: np.ndarray
    quaternion: np.ndarray | None
    commanded: np.ndarray | None = None
    target: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.joints)

    @property
    def turning(self) -> list[int]:
        """Revolute joints."""
        return [int(j) for j in np.flatnonzero(~self.arm.prismatic)]

    def column(self, joint: int) -> str:
        """Its name."""
        return f"j{joint + 1}_{'mm' if self.arm.prismatic[joint] else 'deg'}"

    def measured_at(self, source: np.ndarray) -> "Table":
        """The same joints, with the measurements of other rows and the targets that they are of."""
        quaternion = None if self.quaternion is None else self.quaternion[source]
        target = tuple(self.target[row] for row in source) if self.target else ()
        position = self.position[source]
        return replace(self, position=position, quaternion=quaternion, target=target)

    def write(self, folder: Path, robot: str) -> None:
        """As a bundle."""
        folder.mkdir(parents=True, exist_ok=True)
        header = [self.column(j) for j in range(self.joints.shape[1])]
        blocks = [self.joints]
        if self.commanded is not None:
            header += ["cmd" + name[1:] for name in header]
            blocks.append(self.commanded)
        header += ["x_mm", "y_mm", "z_mm"]
        blocks.append(self.position)
        if self.quaternion is not None:
            header += ["qw", "qx", "qy", "qz"]
            blocks.append(self.quaternion)
        lines = [",".join(f"{value:.9g}" for value in row) for row in np.hstack(blocks)]
        campaign = "robot: robot.yaml\ninstrument: {kind: laser_tracker, sigma_mm: 0.03}\n"
        if self.target:
            header.append("target")
            lines = [f"{line},{name}" for line, name in zip(lines, self.target, strict=True)]
            names = ", ".join(f"{name}: {{}}" for name in sorted({*self.target} - {""}))
            campaign += f"targets: {{{names}}}\n"
        (folder / "measurements.csv").write_text("\n".join([",".join(header), *lines]) + "\n")
        (folder / "campaign.yaml").write_text(campaign)
        (folder / "robot.yaml").write_text(robot_text(robot))


@dataclass(frozen=True)
class Campaign:
    """How a campaign is measured; the seed draws what is left open."""

    robot: str
    seed: int
    rows: int = 60
    full_pose: bool = True
    outliers: float = 0.0
    sag_mm: float = 0.0
    widest: float = 2.5
    targets: tuple[str, ...] = field(default=())
    """By turns, a pose each."""
    nests: int = 1
    """Or so many at every pose, one row each: `rows` counts them all."""

    def measure(self) -> Table:
        """Geometry off by 0.3 to 1 mm and 1 to 3 mrad a parameter, noise of 0.02 to 0.05 mm."""
        rng = np.random.default_rng(self.seed)
        nominal = arm_from_document(yaml.safe_load(robot_text(self.robot)))
        length, angle = rng.uniform(0.3e-3, 1e-3), rng.uniform(1e-3, 3e-3)
        errors = rng.normal(size=nominal.links.shape) * [angle, length, length, angle, angle]
        tool = random_frame(rng, 0.0)
        tool[:3, 3] = rng.uniform(0.04, 0.12, 3) * rng.choice([-1, 1], 3)
        true = replace(nominal, links=nominal.links + errors)
        true = true.within(random_frame(rng, 3.0), tool)
        names = tuple(f"n{i + 1}" for i in range(self.nests)) if self.nests > 1 else self.targets
        q = nominal.draw(rng, self.rows // self.nests, self.widest).repeat(self.nests, axis=0)
        T = true.poses(self._sagged(true, q))
        places = {name: rng.uniform(-0.1, 0.1, 3) for name in names}
        target = tuple(names[i % len(names)] for i in range(self.rows)) if names else ()
        position = T[:, :3, 3].copy()
        for row, name in enumerate(target):
            position[row] += T[row, :3, :3] @ places[name]
        position += rng.normal(size=position.shape) * rng.uniform(0.02e-3, 0.05e-3)
        for row in np.flatnonzero(rng.random(self.rows) < self.outliers):
            position[row] += rng.normal(size=3) * 10 ** rng.uniform(-4, 0)
        noisy = Rotation.from_rotvec(1e-4 * rng.normal(size=(self.rows, 3)))
        x, y, z, w = (noisy * Rotation.from_matrix(T[:, :3, :3])).as_quat().T
        quaternion = np.column_stack([w, x, y, z]) if self.full_pose else None
        return Table(nominal, q / nominal.units(), position * 1e3, quaternion, target=target)

    def _sagged(self, arm: Arm, q: np.ndarray) -> np.ndarray:
        """Joints 2 and 3 yield to gravity: up to `sag_mm` at full reach."""
        q = q.copy()
        reach = np.hypot(arm.links[:, 1], arm.links[:, 2]).sum()
        if self.sag_mm and not arm.prismatic.any():
            q[:, 1] += self.sag_mm * 1e-3 / reach * np.cos(q[:, 1])
            q[:, 2] += self.sag_mm * 1e-3 / reach * np.cos(q[:, 1] + q[:, 2])
        return q


@dataclass(frozen=True)
class Spoiled:
    """A table with a slip in it, and how the slip must be named."""

    table: Table
    fault: str
    columns: tuple[str, ...]
    mend: str
    """Words that the sentence must hold."""
    lines: tuple[int, ...] = ()
    exact: bool = True
    """Not up to a turn of the measuring frame."""


Slipper = Callable[[Table, np.random.Generator], Spoiled]
POSITION = ("x_mm", "y_mm", "z_mm")
QUATERNION = ("qw", "qx", "qy", "qz")
UNITS = ((1e-3, "1000"), (1 / 25.4, "25.4"), (0.1, "10"), (1e3, "0.001"))


def radians(t: Table, rng) -> Spoiled:
    joints = t.joints.copy()
    joints[:, t.turning] *= np.pi / 180
    columns = tuple(t.column(j) for j in t.turning)
    return Spoiled(replace(t, joints=joints), "unit", columns, "multiply by 180/pi")


def one_joint_in_radians(t: Table, rng) -> Spoiled:
    return _scaled_joint(t, "unit", rng.choice(t.turning), np.pi / 180, "multiply by 180/pi")


def stroke_in_metres(t: Table, rng) -> Spoiled:
    slide = int(np.flatnonzero(t.arm.prismatic)[0])
    return _scaled_joint(t, "unit", slide, 1e-3, "is in m: multiply by 1000")


def joint_sign(t: Table, rng) -> Spoiled:
    return _scaled_joint(t, "joint_sign", rng.choice(t.turning), -1.0, "multiply it by -1")


def _scaled_joint(t: Table, fault: str, joint: int, factor: float, mend: str) -> Spoiled:
    joints = t.joints.copy()
    joints[:, joint] *= factor
    return Spoiled(replace(t, joints=joints), fault, (t.column(joint),), mend)


def zero_of_a_joint(t: Table, rng) -> Spoiled:
    inner = [j for j in t.turning if 0 < j < t.joints.shape[1] - 1]
    joint = rng.choice(inner)
    joints = t.joints.copy()
    by = rng.choice([-90, 90])
    joints[:, joint] += by
    mend = "subtract 90 from it" if by > 0 else "add 90 to it"
    return Spoiled(replace(t, joints=joints), "angle_convention", (t.column(joint),), mend)


def coupled_joints(t: Table, rng) -> Spoiled:
    """Joint 3 counted from the ground; joint 2 of a SCARA."""
    first = 0 if t.arm.prismatic.any() else 1
    joints = t.joints.copy()
    sign, driver = rng.choice([-1, 1]), t.column(first)
    joints[:, first + 1] += sign * joints[:, first]
    mend = f"subtract {driver} from it" if sign > 0 else f"add {driver} to it"
    return Spoiled(replace(t, joints=joints), "angle_convention", (t.column(first + 1),), mend)


def exchanged_columns(t: Table, rng) -> Spoiled:
    a, b = sorted(rng.choice(t.turning, 2, replace=False))
    joints = t.joints.copy()
    joints[:, [a, b]] = joints[:, [b, a]]
    columns = (t.column(a), t.column(b))
    mend = f"columns {columns[0]} and {columns[1]} are exchanged"
    return Spoiled(replace(t, joints=joints), "wrong_joint_source", columns, mend)


def columns_moved_on(t: Table, rng) -> Spoiled:
    joints, turning = t.joints.copy(), t.turning
    by = int(rng.integers(1, len(turning)))
    joints[:, turning] = np.roll(joints[:, turning], by, axis=1)
    columns = tuple(t.column(j) for j in range(joints.shape[1]))
    stand = list(columns)
    for place, joint in enumerate(turning):
        stand[joint] = columns[turning[(place + by) % len(turning)]]
    mend = f"stand in {', '.join(stand)}"
    return Spoiled(replace(t, joints=joints), "wrong_joint_source", columns, mend)


def stale_joints(t: Table, rng) -> Spoiled:
    """The joint columns were read from another program; the commanded ones are right."""
    other = t.arm.draw(rng, len(t)) / t.arm.units()
    columns = tuple(t.column(j) for j in range(other.shape[1]))
    table = replace(t, joints=other, commanded=t.joints)
    return Spoiled(table, "wrong_joint_source", columns, "take those of cmd1")


def positions_in_another_unit(t: Table, rng) -> Spoiled:
    by, mend = UNITS[rng.integers(len(UNITS))]
    return Spoiled(replace(t, position=t.position * by), "unit", POSITION, f"multiply by {mend}")


def an_axis_turned(t: Table, rng) -> Spoiled:
    axis = rng.integers(3)
    position = t.position.copy()
    position[:, axis] *= -1
    column = POSITION[axis]
    return _mirrored(t, position, (column,), f"{column} has its sign turned: multiply it by -1")


def coordinates_exchanged(t: Table, rng) -> Spoiled:
    a, b = sorted(rng.choice(3, 2, replace=False))
    position = t.position.copy()
    position[:, [a, b]] = position[:, [b, a]]
    columns = (POSITION[a], POSITION[b])
    return _mirrored(t, position, columns, f"{columns[0]} and {columns[1]} are exchanged")


def _mirrored(t: Table, position: np.ndarray, columns: tuple[str, ...], mend: str) -> Spoiled:
    """Positions alone do not show the columns; turning any axis mends them all."""
    exact = t.quaternion is not None
    if not exact:
        columns, mend = POSITION, "multiply z_mm by -1"
    return Spoiled(replace(t, position=position), "mirrored_frame", columns, mend, exact=exact)


def poses_left_handed(t: Table, rng) -> Spoiled:
    """A whole left-handed frame, orientations with it."""
    S = np.diag([1.0, -1.0, 1.0])
    w, x, y, z = t.quaternion.T
    R = S @ Rotation.from_quat(np.column_stack([x, y, z, w])).as_matrix() @ S
    return Spoiled(
        replace(t, position=t.position @ S, quaternion=wxyz(Rotation.from_matrix(R))),
        "mirrored_frame",
        (*POSITION, *QUATERNION),
        "multiply z_mm, qx and qy by -1",
        exact=False,
    )


def quaternion_last_first(t: Table, rng) -> Spoiled:
    return _turned(t, "quaternion_order", np.roll(t.quaternion, -1, axis=1), "move qz to the front")


def quaternion_first_last(t: Table, rng) -> Spoiled:
    return _turned(t, "quaternion_order", np.roll(t.quaternion, 1, axis=1), "move qw to the end")


def passive_orientation(t: Table, rng) -> Spoiled:
    mend = "multiply qx, qy and qz by -1"
    return _turned(t, "quaternion_order", t.quaternion * [1, -1, -1, -1], mend)


def euler_order(t: Table, rng) -> Spoiled:
    """Angles of one order, made into a quaternion by the other (SciPy's intrinsic orders)."""
    w, x, y, z = t.quaternion.T
    right, wrong = rng.permutation(["ZYX", "XYZ"])
    angles = Rotation.from_quat(np.column_stack([x, y, z, w])).as_euler(right)
    # From the order of the turns to x, y, z and back: the angles stay with their axes.
    wrongly = wxyz(Rotation.from_euler(wrong, angles[:, ::-1]))
    product = "Rz(c) Ry(b) Rx(a)" if right == "ZYX" else "Rx(a) Ry(b) Rz(c)"
    return _turned(t, "angle_convention", wrongly, f"make them from {product}")


def euler_columns_turned_round(t: Table, rng) -> Spoiled:
    """Roll, pitch, yaw taken for yaw, pitch, roll."""
    w, x, y, z = t.quaternion.T
    angles = Rotation.from_quat(np.column_stack([x, y, z, w])).as_euler("ZYX")
    wrongly = wxyz(Rotation.from_euler("ZYX", angles[:, ::-1]))
    return _turned(t, "angle_convention", wrongly, "exchange qx and qz")


def _turned(t: Table, fault: str, quaternion: np.ndarray, mend: str) -> Spoiled:
    return Spoiled(replace(t, quaternion=quaternion), fault, QUATERNION, mend)


def wxyz(rotation: Rotation) -> np.ndarray:
    x, y, z, w = rotation.as_quat().T
    return np.column_stack([w, x, y, z])


def rows_shifted(t: Table, rng) -> Spoiled:
    """From some row on, or all; the file is as long as the rows that still have both."""
    n, by = len(t), int(rng.choice([-5, -4, -3, -2, -1, 1, 2, 3, 4, 5]))
    first = int(rng.choice([0, rng.integers(8, n - 8)]))
    source = np.arange(n)
    source[first:] -= by
    kept = (source >= 0) & (source < n)
    source = np.clip(source, 0, n - 1)
    spoiled = t.measured_at(source)
    spoiled = keep_rows(spoiled, kept)
    # A file that loses its first rows and is shifted as a whole starts later; lines count from 2.
    count = np.arange(kept.sum())[np.flatnonzero(kept) >= first]
    mend = f"joints {abs(by)} row{'s' if abs(by) > 1 else ''} {'earlier' if by > 0 else 'later'}"
    return Spoiled(spoiled, "row_shift", (), mend, tuple(int(row) + 2 for row in count))


def rows_exchanged(t: Table, rng) -> Spoiled:
    a, b = 0, 0
    while np.array_equal(t.joints[a], t.joints[b]):  # nests of one pose may stand in any order
        a, b = sorted(int(row) for row in rng.choice(len(t), 2, replace=False))
    source = np.arange(len(t))
    source[[a, b]] = b, a
    mend = f"lines {a + 2} and {b + 2} are exchanged: exchange them back"
    return Spoiled(t.measured_at(source), "swapped_rows", (), mend, (a + 2, b + 2))


def keep_rows(t: Table, kept: np.ndarray) -> Table:
    """Some rows whole, by number or by True."""
    rows = np.arange(len(t))[kept]
    return replace(t.measured_at(rows), joints=t.joints[rows])


SLIPS: tuple[Slipper, ...] = (
    radians, one_joint_in_radians, joint_sign, zero_of_a_joint, coupled_joints, exchanged_columns,
    columns_moved_on, stale_joints, positions_in_another_unit, an_axis_turned,
    coordinates_exchanged, rows_shifted, rows_exchanged,
)  # fmt: skip
SCARA_SLIPS: tuple[Slipper, ...] = (stroke_in_metres,)
POSE_SLIPS: tuple[Slipper, ...] = (
    poses_left_handed, quaternion_last_first, quaternion_first_last, passive_orientation,
    euler_order, euler_columns_turned_round,
)  # fmt: skip


def slips_of(table: Table) -> tuple[Slipper, ...]:
    """Kinds that this table can have."""
    kinds = SLIPS
    if table.arm.prismatic.any():
        kinds = (*kinds, *SCARA_SLIPS)
    elif table.joints.shape[1] == 7:  # no neighbouring parallel axes
        kinds = tuple(kind for kind in kinds if kind is not coupled_joints)
    return kinds if table.quaternion is None else (*kinds, *POSE_SLIPS)

"""Slips of the joint columns: unit, sign, zero, coupling, order, source.

Each is one affine map from the joints in the file to the joints that were meant. Zero shifts of the
first and the last joint are not slips: base and tool absorb them.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.data_faults.slip import Fault, Slip
from robocal.formats.measurements_csv import joint_columns
from robocal.measurements import MeasurementSet
from robocal.robots.robot import Robot

_QUARTER = np.pi / 2.0
_DEGREES = 180.0 / np.pi


@dataclass(frozen=True)
class JointMap:
    """Joints that were meant = matrix @ joints of the file + offset."""

    matrix: Float[Array, "joint joint"]
    offset: Float[Array, "joint"]

    def joints(self, rows: MeasurementSet) -> Float[Array, "row joint"]:
        """Joints that were meant."""
        return np.asarray(rows.joints @ self.matrix.T + self.offset)

    def __call__(self, rows: MeasurementSet) -> MeasurementSet:
        """The rows with these joints."""
        return replace(rows, joints=self.joints(rows))


@dataclass(frozen=True)
class CommandedJoints:
    """The joint columns hold something else; the commanded joints are what the robot did."""

    def joints(self, rows: MeasurementSet) -> Float[Array, "row joint"]:
        """Joints that were meant."""
        return rows.commanded

    def __call__(self, rows: MeasurementSet) -> MeasurementSet:
        """The rows with these joints."""
        return replace(rows, joints=rows.commanded)


@dataclass(frozen=True)
class JointSlip:
    """A hypothesis about the joint columns: slips in the order in which they are mended."""

    slips: tuple[Slip, ...]
    maps: tuple[JointMap | CommandedJoints, ...]

    def joints(self, rows: MeasurementSet) -> Float[Array, "row joint"]:
        """Joints that were meant."""
        for change in self.maps:
            rows = change(rows)
        return rows.joints


AS_WRITTEN = JointSlip((), ())


def single_joint_slips(robot: Robot, rows: MeasurementSet) -> tuple[JointSlip, ...]:
    """Every slip of one kind that this robot can have."""
    found = [
        *_units(robot),
        *_signs(robot),
        *_zeros(robot),
        *_couplings(robot),
        *_orders(robot),
    ]
    if np.isfinite(rows.commanded).all():
        columns = joint_columns(robot)
        sentence = (
            f"columns {columns[0]} to {columns[-1]} are not the joints at which the target was "
            "measured: take those of cmd1 and following"
        )
        change = CommandedJoints()
        slip = Slip(Fault.wrong_joint_source, columns, sentence, change)
        found.append(JointSlip((slip,), (change,)))
    return tuple(found)


def paired_joint_slips(robot: Robot) -> tuple[JointSlip, ...]:
    """Pairs that happen together: two signs or zeros, either with a coupling, or with radians."""
    signs, zeros = list(_signs(robot)), list(_zeros(robot))
    couplings, units = list(_couplings(robot)), list(_units(robot))
    pairs = [
        *combinations(signs, 2),
        *((sign, zero) for sign in signs for zero in zeros),
        *(
            (one, other)
            for one, other in combinations(zeros, 2)
            if one.slips[0].columns != other.slips[0].columns
        ),
        *((one, coupling) for one in (*signs, *zeros) for coupling in couplings),
    ]
    if units:
        pairs += [(units[0], other) for other in (*signs, *zeros, *couplings, *_orders(robot))]
    return tuple(JointSlip(a.slips + b.slips, a.maps + b.maps) for a, b in pairs)


def _slip(
    fault: Fault,
    columns: tuple[str, ...],
    sentence: str,
    matrix: Float[Array, "joint joint"],
    offset: Float[Array, "joint"] | None = None,
) -> JointSlip:
    change = JointMap(matrix, np.zeros(len(matrix)) if offset is None else offset)
    return JointSlip((Slip(fault, columns, sentence, change),), (change,))


def _revolute(robot: Robot) -> list[int]:
    return [int(joint) for joint in np.flatnonzero(~robot.geometry.prismatic)]


def _units(robot: Robot) -> Iterator[JointSlip]:
    """All angles in radians first, then the reverse, then single columns."""
    columns, turning = joint_columns(robot), _revolute(robot)
    groups = [turning, *([joint] for joint in turning)]
    for group in groups if turning else []:
        names = tuple(columns[joint] for joint in group)
        yield _scaled(robot, group, names, _DEGREES, "in radians: multiply by 180/pi")
        # One column alone made so small would only say that its joint may as well stand still.
        if group is turning:
            text = "taken to degrees twice: multiply by pi/180"
            yield _scaled(robot, group, names, 1.0 / _DEGREES, text)
    for joint in np.flatnonzero(robot.geometry.prismatic):
        names = (columns[joint],)
        for unit, factor in (("m", 1e3), ("inches", 25.4)):
            text = f"in {unit}: multiply by {factor:g}"
            yield _scaled(robot, [int(joint)], names, factor, text)
        yield _scaled(robot, [int(joint)], names, 1e-3, "in um: multiply by 0.001")


def _scaled(
    robot: Robot, group: list[int], names: tuple[str, ...], factor: float, text: str
) -> JointSlip:
    scale = np.ones(robot.n_joints)
    scale[group] = factor
    columns = f"column {names[0]} is" if len(names) == 1 else f"columns {_listed(names)} are"
    return _slip(Fault.unit, names, f"{columns} {text}", np.diag(scale))


def _signs(robot: Robot) -> Iterator[JointSlip]:
    for joint, column in enumerate(joint_columns(robot)):
        scale = np.ones(robot.n_joints)
        scale[joint] = -1.0
        sentence = f"column {column} has its sign turned: multiply it by -1"
        yield _slip(Fault.joint_sign, (column,), sentence, np.diag(scale))


def _zeros(robot: Robot) -> Iterator[JointSlip]:
    turning = _revolute(robot)
    columns = joint_columns(robot)
    for joint in turning:
        if joint in (0, robot.n_joints - 1):
            continue
        for degrees in (90, -90):
            offset = np.zeros(robot.n_joints)
            offset[joint] = np.sign(degrees) * _QUARTER
            word = "add" if degrees > 0 else "subtract"
            preposition = "to" if degrees > 0 else "from"
            sentence = (
                f"column {columns[joint]} counts from another zero: {word} 90 {preposition} it"
            )
            yield _slip(
                Fault.angle_convention,
                (columns[joint],),
                sentence,
                np.eye(robot.n_joints),
                offset,
            )


def _couplings(robot: Robot) -> Iterator[JointSlip]:
    """Neighbouring parallel axes, where one angle may be counted from the ground."""
    links, columns = robot.geometry.links, joint_columns(robot)
    for joint in range(robot.n_joints - 1):
        slides = robot.geometry.prismatic[joint : joint + 2].any()
        parallel = abs(np.sin(links[joint, 3])) < 1e-3 and abs(np.sin(links[joint, 4])) < 1e-3
        if slides or not parallel:
            continue
        for factor, word in ((1.0, "add"), (-1.0, "subtract")):
            matrix = np.eye(robot.n_joints)
            matrix[joint + 1, joint] = factor
            preposition = "to" if factor > 0 else "from"
            sentence = (
                f"column {columns[joint + 1]} is not counted from the link before it: "
                f"{word} {columns[joint]} {preposition} it"
            )
            yield _slip(Fault.angle_convention, (columns[joint + 1],), sentence, matrix)


def _orders(robot: Robot) -> Iterator[JointSlip]:
    """Two columns exchanged, all turned round, all moved on."""
    columns, n = joint_columns(robot), robot.n_joints
    turning = _revolute(robot)
    for a, b in combinations(turning, 2):
        order = list(range(n))
        order[a], order[b] = b, a
        sentence = f"columns {columns[a]} and {columns[b]} are exchanged: exchange them back"
        yield _slip(Fault.wrong_joint_source, (columns[a], columns[b]), sentence, np.eye(n)[order])
    for order in _whole_orders(turning):
        full = list(range(n))
        for place, source in zip(turning, order, strict=True):
            full[place] = source
        taken = ", ".join(columns[source] for source in full)
        sentence = (
            f"the joint columns are in another order: "
            f"{columns[0]} to {columns[-1]} stand in {taken}"
        )
        yield _slip(Fault.wrong_joint_source, columns, sentence, np.eye(n)[full])


def _whole_orders(turning: list[int]) -> Iterable[list[int]]:
    if len(turning) < 3:
        return []
    moved = [turning[k:] + turning[:k] for k in range(1, len(turning))]
    backwards = turning[::-1]
    exchanged = sum(a != b for a, b in zip(backwards, turning, strict=True)) == 2
    return moved if exchanged else [backwards, *moved]


def _listed(names: tuple[str, ...]) -> str:
    return f"{', '.join(names[:-1])} and {names[-1]}"

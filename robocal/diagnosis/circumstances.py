"""What was going on when each row was read: everything that an effect may depend on."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.diagnosis.reference import PAYLOAD, Reference, is_timed, reference_of
from robocal.kinematics.forward import Columns, walk
from robocal.kinematics.model import KinematicModel
from robocal.measurements import MeasurementSet, approach_column
from robocal.robots.robot import LinkMass, Robot

_G = 9.80665
"""Standard acceleration of gravity [m/s2]"""
_LONG = 0.2
"""Share of the longest link that counts as long; [1]"""
TIP = "tip"
"""The tool's place among those where unknown masses are thought to be."""


@dataclass(frozen=True)
class Circumstances:
    """Rows in the order in which they were measured. NaN where the file does not say.

    Parameters
    ----------
    robot
        Nominal robot, whose masses and geometry give the gravity torques.
    gravity
        Direction of gravity in the robot base.
    tool_place
        Where the payload is thought to hang, in the flange frame [m].
    joints, previous
        Readings of the row and of the row before [rad or m].
    lines
        Where in the campaign, by the lines of its file; those of rows that a model predicts are
        told by their time.
    time
        [s]; the row's number over the count where the file has no times.
    reference
        What `progress`, `warmer` and `hurry` are counted from, and which columns its rows filled.
    """

    robot: Robot
    gravity: Float[Array, "3"]
    tool_place: Float[Array, "3"]
    base_rotation: Float[Array, "3 3"]
    """Axes of the robot base in the measuring frame."""
    position: Float[Array, "row 3"]
    """Where the instrument saw the target [m]."""
    joints: Float[Array, "row joint"]
    previous: Float[Array, "row joint"]
    lines: Int[Array, "row"] | Float[Array, "row"]
    time: Float[Array, "row"]
    timed: bool
    """Whether `time` is in seconds."""
    temperature: Float[Array, "row"]
    payload: Float[Array, "row"]
    speed: Float[Array, "row"]
    settle: Float[Array, "row"]
    approach: Float[Array, "row joint"]
    reference: Reference

    def __len__(self) -> int:
        return len(self.joints)

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return int(self.joints.shape[1])

    @cached_property
    def progress(self) -> Float[Array, "row"]:
        """Time from 0 to 1 over the campaign that the reference is of."""
        return np.asarray((self.time - self.reference.time_start) / self.reference.time_span)

    @cached_property
    def hurry(self) -> Float[Array, "row"]:
        """Speed of the last move over the reference, one where the file does not say."""
        return np.asarray(np.nan_to_num(self.speed / self.reference.speed, nan=1.0))

    @cached_property
    def warmer(self) -> Float[Array, "row"]:
        """Temperature over the reference [K]."""
        return np.asarray(self.temperature - self.reference.temperature)

    @cached_property
    def has_temperature(self) -> bool:
        """Whether the temperature was read and varied."""
        return bool(np.isfinite(self.temperature).all() and np.ptp(self.temperature) > 0.2)

    @cached_property
    def has_payload(self) -> bool:
        """Whether the payload is known and differs between rows."""
        return bool(np.isfinite(self.payload).all() and np.ptp(self.payload) > 0)

    @cached_property
    def carried(self) -> Float[Array, "row"]:
        """Payload that acts [kg]: none where a row of a campaign does not say that left some out.

        Where the campaign's rows all said it, a row that does not is unknown.
        """
        return self._as_in_campaign(self.payload, PAYLOAD)

    def side(self, joint: int) -> Float[Array, "row"]:
        """Direction in which a joint (from 1) last moved, zero where `carried` would be none."""
        return self._as_in_campaign(self.approach[:, joint - 1], approach_column(joint))

    def _as_in_campaign(self, cells: Float[Array, "row"], column: str) -> Float[Array, "row"]:
        return cells if column in self.reference.complete else np.nan_to_num(cells)

    @cached_property
    def _chain(self) -> tuple[list[Float[Array, "3 row"]], list[Float[Array, "3 row"]], Array]:
        """Axis and point of every joint, and the flange, in the robot base."""
        geometry = self.robot.geometry
        bare = KinematicModel(geometry.links, geometry.prismatic, mount=geometry.mount)
        last, joints = walk(bare, self.joints)
        n = len(self)
        axes = [np.broadcast_to(joint.z, (3, n)) for joint in joints]
        points = [np.broadcast_to(joint.before, (3, n)) for joint in joints]
        tool = last.then(geometry.flange)
        t = self.tool_place
        hand = tool.p + tool.x * t[0] + tool.y * t[1] + tool.z * t[2]
        return axes, points, hand

    @cached_property
    def tool_axes(self) -> tuple[Float[Array, "3 row"], ...]:
        """Axes of the nominal flange, in the robot base."""
        flange = self._frame_after(self.n_joints).then(self.robot.geometry.flange)
        return flange.x, flange.y, flange.z

    def axes_before(self, joint: int) -> tuple[Float[Array, "3 row"], ...]:
        """The nominal x and y that a joint (from 1) turns from, in the robot base."""
        frame = self._frame_after(joint - 1)
        return tuple(np.broadcast_to(axis, (3, len(self))) for axis in (frame.x, frame.y))

    def _frame_after(self, count: int) -> Columns:
        geometry = self.robot.geometry
        part = KinematicModel(
            geometry.links[:count], geometry.prismatic[:count], mount=geometry.mount
        )
        return walk(part, self.joints[:, :count])[0]

    @property
    def hand(self) -> Float[Array, "3 row"]:
        """Where the payload is thought to hang, in the robot base [m]."""
        return self._chain[2]

    def torque_of(
        self, joint: int, mass: Float[Array, "row"] | float, centre: Float[Array, "3 row"]
    ) -> Float[Array, "row"]:
        """Gravity torque about a joint's axis of a mass at given points of the base [Nm]."""
        axes, points, _ = self._chain
        force = self.gravity[:, None] * (_G * mass)
        arm = centre - points[joint]
        return np.asarray(
            (axes[joint] * np.cross(arm, np.broadcast_to(force, arm.shape), axis=0)).sum(axis=0)
        )

    @cached_property
    def payload_torque(self) -> Float[Array, "joint row"]:
        """Gravity torque of the payload about every joint [Nm]."""
        return np.stack([self.torque_of(j, self.carried, self.hand) for j in range(self.n_joints)])

    @cached_property
    def link_torque(self) -> Float[Array, "joint row"]:
        """Gravity torque of the links about every joint [Nm]; zero without masses."""
        torque = np.zeros((self.n_joints, len(self)))
        if self.robot.masses is None:
            return torque
        for link, (mass, centre) in enumerate(self.link_centres):
            for joint in range(link + 1):
                torque[joint] += self.torque_of(joint, mass, centre)
        return torque

    @cached_property
    def link_centres(self) -> list[tuple[float, Float[Array, "3 row"]]]:
        """Mass and centre of every link in the robot base [kg, m]."""
        masses = self.robot.masses or (LinkMass(0.0, (0.0, 0.0, 0.0)),) * self.n_joints
        centres = []
        for link, entry in enumerate(masses):
            frame = self._frame_after(link + 1)
            x, y, z = entry.centre
            centre = frame.p + frame.x * x + frame.y * y + frame.z * z
            centres.append((entry.mass, np.broadcast_to(centre, (3, len(self)))))
        return centres

    @cached_property
    def mass_places(self) -> dict[str, Float[Array, "3 row"]]:
        """End of every long link by its number, and the tool's place, in the robot base [m]."""
        geometry = self.robot.geometry
        lengths = np.hypot(geometry.links[:, 1], geometry.links[:, 2])
        places = {}
        for link in np.flatnonzero(lengths > _LONG * lengths.max()).tolist():
            frame = self._frame_after(link + 1)
            places[str(link + 1)] = np.asarray(np.broadcast_to(frame.p, (3, len(self))))
        return {**places, TIP: self.hand}

    @cached_property
    def torque(self) -> Float[Array, "joint row"]:
        """Gravity torque of links and payload about every joint [Nm]."""
        return np.asarray(self.link_torque + self.payload_torque)

    @cached_property
    def moment(self) -> Float[Array, "3 row"]:
        """Overturning moment of links and payload about the base's origin [Nm]."""
        total = self.moment_of(self.carried, self.hand)
        for mass, centre in self.link_centres:
            total = total + self.moment_of(mass, centre)
        return total

    def moment_of(
        self, mass: Float[Array, "row"] | float, centre: Float[Array, "3 row"]
    ) -> Float[Array, "3 row"]:
        """Moment about the base's origin of the weight of a mass at points of the base [Nm]."""
        force = np.broadcast_to(self.gravity[:, None] * (_G * mass), centre.shape)
        return np.asarray(np.cross(centre, force, axis=0))

    def moment_about(self, point: Float[Array, "3 _"], behind: int) -> Float[Array, "3 row"]:
        """Moment of the payload and of the links behind link `behind` about a point [Nm]."""
        force = self.gravity[:, None] * _G
        total = np.cross(self.hand - point, force * self.carried, axis=0)
        for mass, centre in self.link_centres[behind + 1 :]:
            arm = centre - point
            total = total + np.cross(arm, np.broadcast_to(force * mass, arm.shape), axis=0)
        return np.asarray(total)

    def weight_behind(self, behind: int) -> Float[Array, "3 row"]:
        """Weight of the payload and of the links behind link `behind` [N]."""
        mass = self.carried + sum(m for m, _ in self.link_centres[behind + 1 :])
        return np.asarray(self.gravity[:, None] * (_G * mass))

    @cached_property
    def reach(self) -> Float[Array, "row"]:
        """Distance of the tool from axis 1 [m]."""
        return np.asarray(np.hypot(self.hand[0], self.hand[1]))

    def rows(self, choice: Bool[Array, "row"] | Int[Array, "_"]) -> "Circumstances":
        """Some of the rows, by mask or number; their predecessors stay what they were."""
        names = ["position", "joints", "previous", "lines", "time", "temperature", "payload"]
        names += ["speed", "settle", "approach"]
        return Circumstances(
            robot=self.robot,
            gravity=self.gravity,
            tool_place=self.tool_place,
            base_rotation=self.base_rotation,
            timed=self.timed,
            reference=self.reference,
            **{name: getattr(self, name)[choice] for name in names},
        )


def circumstances(
    robot: Robot,
    gravity: Float[Array, "3"],
    tool_place: Float[Array, "3"],
    base_rotation: Float[Array, "3 3"],
    rows: MeasurementSet,
    reference: Reference | None = None,
) -> Circumstances:
    """The circumstances of measured rows, which stand in the order of measuring.

    The reference is taken from the rows unless a model brings its own: then they stand where in
    its campaign their time says, at its end where they state none.
    """
    if reference is None:
        timed, lines = is_timed(rows), rows.lines
        time = rows.time if timed else np.arange(len(rows)) / max(len(rows), 1)
        reference = reference_of(rows, time)
    else:
        timed, lines = reference.timed, reference.line_at(rows.time)
        time = reference.time_at(rows.time)
    previous = np.concatenate([rows.joints[:1], rows.joints[:-1]])
    return Circumstances(
        robot=robot,
        gravity=gravity,
        tool_place=tool_place,
        base_rotation=base_rotation,
        position=np.nan_to_num(rows.position),
        joints=rows.joints,
        previous=previous,
        lines=lines,
        time=time,
        timed=timed,
        temperature=rows.temperature,
        payload=rows.payload,
        speed=rows.speed,
        settle=rows.settle,
        approach=rows.approach,
        reference=reference,
    )

"""What an import of a robot needs and gives, whatever the format."""

from dataclasses import dataclass

from robocal.robots.robot import Robot


@dataclass(frozen=True)
class RobotOptions:
    """What the user says beyond the file; None where nothing."""

    name: str | None = None
    """Name for the robot"""
    nominal: Robot | None = None
    """UR calibration.conf: the robot that its deltas are added to"""
    euler: str | None = None
    """UR kinematics: how the angles were computed, where not as URDF reads them"""


@dataclass(frozen=True)
class ImportedRobot:
    """A robot and what its user should know of the import."""

    robot: Robot
    notes: tuple[str, ...]

"""Whether a planned calibration can give more numbers than the robot has parameters."""

from robocal.robots.robot import Robot
from service.campaigns.measurements import HELD_OUT_FRACTION
from service.errors import Unusable

_OF_REVOLUTE, _OF_PRISMATIC = 4, 2
"""Parameters that measuring can tell of a joint; after Mooring, Roth and Driels (1991)."""
_POSE, _POSITION = 6, 3
"""Numbers of one reading, which is also what the frames of base and tool add to the parameters."""


def require_enough(robot: Robot, count: int) -> None:
    """Refuse a number of poses that no tracker makes sufficient; raises `Unusable`."""
    least = least_poses(robot)
    if count < least:
        raise Unusable(
            f"body poses: {count} cannot determine robot '{robot.name}': with "
            f"{HELD_OUT_FRACTION:.0%} of them held out it takes at least {least}, "
            f"or {_least_poses(robot, _POSITION)} where the tracker sees no orientation; "
            "twice that is sensible."
        )


def least_poses(robot: Robot) -> int:
    """Fewest planned poses that can determine a robot, orientation seen."""
    return _least_poses(robot, _POSE)


def _least_poses(robot: Robot, numbers: int) -> int:
    prismatic = robot.joint_units.count("mm")
    revolute = len(robot.joint_units) - prismatic
    wanted = _OF_REVOLUTE * revolute + _OF_PRISMATIC * prismatic + numbers
    count = 1
    while (count - round(HELD_OUT_FRACTION * count)) * numbers < wanted:
        count += 1
    return count

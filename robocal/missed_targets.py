"""What to tell a person of a wanted pose that compensation does not simply reach."""

import numpy as np

from robocal.compensation import Compensation
from robocal.reach import Reach
from robocal.robots.robot import Robot


def missed_sentence(found: Compensation, row: int, robot: Robot) -> str:
    """Why the target of a row counts as missed, with the figure that says so."""
    reach = found.reach[row]
    off = (
        f"{found.position_error[row] * 1e3:.4g} mm and "
        f"{np.degrees(found.angle_error[row]):.4g} deg off"
    )
    return {
        Reach.reached: "reached",
        Reach.outside_limits: f"met only with {_beyond(found, row, robot)}",
        Reach.singular: f"the arm is singular here: joints turn far for little, {off}",
        Reach.other_configuration: (
            "met only with shoulder, elbow or wrist on the other side than the nominal joints"
        ),
        Reach.not_reached: f"the arm does not come there, {off}",
    }[reach]


def _beyond(found: Compensation, row: int, robot: Robot) -> str:
    """The joints beyond their limits, in file units."""
    said = []
    for joint, unit in enumerate(robot.joint_units):
        reading, low, high = (
            float(value) / robot.joint_scale[joint]
            for value in (found.q[row, joint], *robot.limits[joint])
        )
        if not low <= reading <= high:
            said.append(f"joint {joint + 1} at {reading:.3f} {unit} ({low:g} to {high:g} allowed)")
    return ", ".join(said)

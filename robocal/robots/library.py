"""The robots that ship with the package."""

from pathlib import Path

from robocal.errors import BadInput
from robocal.formats.robot_yaml import read_robot
from robocal.robots.robot import Robot

_FOLDER = Path(__file__).parent

ROBOTS = (
    "abb_irb120",
    "abb_irb910sc",
    "kuka_iiwa14",
    "staubli_tx60",
    "ur3e",
    "ur5",
    "ur5e",
    "ur10",
    "ur10e",
)


def robot_path(name: str) -> Path:
    """File of a robot that ships with the package.

    Raises
    ------
    BadInput
        If there is none of that name.
    """
    if name not in ROBOTS:
        raise BadInput(f"robot '{name}'", f"is not known; known are {', '.join(ROBOTS)}")
    return _FOLDER / f"{name}.yaml"


def load_robot(name: str) -> Robot:
    """A robot that ships with the package."""
    return read_robot(robot_path(name))

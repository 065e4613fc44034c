"""The two robots and the sensors of a base calibration as they were when it was started."""

import math
from collections.abc import Sequence

import yaml
from pydantic import BaseModel
from sqlalchemy.orm import Session

from robocal.robots.library import ROBOTS, load_robot, robot_path
from service.base_calibrations.models import (
    AngleSensor,
    Geometry,
    LengthSensor,
    Role,
    Sensors,
    TouchingRobot,
)
from service.cells import store as cells
from service.cells.models import RobotSettings
from service.errors import Unusable
from service.parameters import store as parameters
from service.parameters.models import ParametersState

_PER_UNIT = {"deg": 180.0 / math.pi, "mm": 1e3}
"""File units in one SI unit."""
CELL_SENSORS = ("slide", "angle", "rod")
"""Names that a cell gives to its stage sensors."""


class StoredRobot(BaseModel):
    """How to reach a robot, and its geometry."""

    cell: str | None
    driver: str
    address: str
    joint_units: list[str]
    geometry: str
    """Contents of robot.yaml, or of model.yaml for released geometry."""
    parameters_version: int | None
    """Of the cell's released parameters, where they are taken."""

    def named_joints(self, joints: Sequence[float]) -> dict[str, float]:
        """Joint readings [SI] by column name, `j1_deg`."""
        return {
            f"j{number}_{unit}": value * _PER_UNIT[unit]
            for number, (value, unit) in enumerate(
                zip(joints, self.joint_units, strict=True), start=1
            )
        }


def find_robot(session: Session, role: Role, wanted: TouchingRobot) -> StoredRobot:
    """Look up driver, address and geometry; raises `NotFound` or `Unusable`."""
    settings = _settings(session, wanted)
    if settings.model not in ROBOTS:
        raise Unusable(
            f"body {role}.robot.model: '{settings.model}' is not known; known are "
            f"{', '.join(ROBOTS)}."
        )
    geometry, version = robot_path(settings.model).read_text(encoding="utf-8"), None
    if wanted.geometry is Geometry.released:
        assert wanted.cell is not None
        row = parameters.newest(session, wanted.cell, ParametersState.released)
        if row.document["model"]["effects"]:
            raise Unusable(
                f"body {role}.geometry: the released parameters of cell '{wanted.cell}' have "
                "effects, which touches are not corrected for; take nominal geometry."
            )
        geometry, version = yaml.safe_dump(row.document["model"], sort_keys=False), row.version
    return StoredRobot(
        cell=wanted.cell,
        driver=settings.driver,
        address=settings.address,
        joint_units=list(load_robot(settings.model).joint_units),
        geometry=geometry,
        parameters_version=version,
    )


def sensors_of_cell(session: Session, cell: str | None) -> Sensors:
    """Return the stage sensors that a cell names slide, angle and rod; raises `Unusable`."""
    if cell is None:
        raise Unusable("body stage.sensors: give the sensors, or a master's cell that has them.")
    found = {
        sensor.name: sensor for sensor in cells.settings_of(cells.find(session, cell)).stage_sensors
    }
    missing = [name for name in CELL_SENSORS if name not in found]
    if missing:
        raise Unusable(
            f"body stage.sensors: cell '{cell}' has no stage sensor named {', '.join(missing)}; "
            "name them so in the cell, or give stage.sensors."
        )
    slide, angle, rod = (found[name] for name in CELL_SENSORS)
    return Sensors(
        slide=LengthSensor(driver=slide.driver, address=slide.address),
        rod_angle=AngleSensor(driver=angle.driver, address=angle.address),
        rod_length=LengthSensor(driver=rod.driver, address=rod.address),
    )


def _settings(session: Session, wanted: TouchingRobot) -> RobotSettings:
    if wanted.cell is not None:
        return cells.settings_of(cells.find(session, wanted.cell)).robot
    assert wanted.robot is not None
    return wanted.robot

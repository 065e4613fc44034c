"""A cell's limits as the numerics want them: SI units, a narrower robot, the surroundings."""

import math
from dataclasses import replace

import numpy as np

from robocal.errors import BadInput
from robocal.formats.measurements_csv import joint_columns
from robocal.instrument import InstrumentNoise
from robocal.planning.cell import Box, Cell, Station
from robocal.robots.robot import Robot
from service.cells.models import CellSettings, Limits, StationSettings
from service.cells.models import Point as PointMm

_MM = 1e-3


def narrowed(robot: Robot, limits: Limits) -> Robot:
    """Return the robot with the joint limits of its cell; raises `BadInput`, naming the joint."""
    columns = joint_columns(robot)
    bounds = robot.limits.copy()
    for column, (low, high) in limits.joints.items():
        if column not in columns:
            raise BadInput(
                "body limits.joints",
                f"robot '{robot.name}' has no joint '{column}'; it has {', '.join(columns)}.",
            )
        joint = columns.index(column)
        least, most = robot.limits[joint] / robot.joint_scale[joint]
        if not least <= low < high <= most:
            raise BadInput(
                f"body limits.joints.{column}",
                f"{low:g} to {high:g} must rise and lie within the robot's own {least:g} to "
                f"{most:g}.",
            )
        bounds[joint] = np.array([low, high]) * robot.joint_scale[joint]
    return replace(robot, limits=bounds)


def surroundings(settings: CellSettings) -> Cell:
    """Return what bounds motions and poses in this cell."""
    limits, tracker = settings.limits, settings.tracker
    box = limits.workspace_mm
    return Cell(
        target=Cell.target if limits.target_mm is None else _metres(limits.target_mm),
        box=None if box is None else Box(_metres(box.low), _metres(box.high)),
        floor=None if limits.floor_mm is None else limits.floor_mm * _MM,
        link_radius=None if limits.link_radius_mm is None else limits.link_radius_mm * _MM,
        station=None if tracker.station is None else _station(tracker.station),
        noise=InstrumentNoise(
            tracker.sigma_mm * _MM, tracker.sigma_ppm * 1e-6, tracker.sigma_mrad * 1e-3
        ),
    )


def _station(station: StationSettings) -> Station:
    nearest, farthest = station.range_mm
    return Station(
        _metres(station.xyz_mm),
        nearest * _MM,
        farthest * _MM,
        station.facing,
        math.radians(station.acceptance_deg),
    )


def _metres(point: PointMm) -> tuple[float, float, float]:
    x, y, z = point
    return x * _MM, y * _MM, z * _MM

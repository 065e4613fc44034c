"""The file `--cell`: what stands round the robot and what sees it. Every field is optional.

::

    target_mm: [50, 30, 100]            # in the flange frame
    box_mm: {low: [..], high: [..]}     # the target stays inside; robot base frame, as all below
    floor_mm: 0                         # or floor: false
    link_radius_mm: 70
    tracker:
      xyz_mm: [2500, 0, 800]
      range_mm: [300, 20000]
      facing: [0, 0, 1]                 # where the target looks, in its own frame
      acceptance_deg: 30
    instrument: {sigma_mm: 0.015, sigma_ppm: 6, sigma_mrad: 0.05, sees: position}   # or pose
    repeatability: {sigma_mm: 0.01, sigma_mrad: 0.02}   # of the robot
    workspace_mm: {low: [..], high: [..]}   # where the tool's uncertainty counts
    payloads_kg: [0, 5]
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from robocal.formats.fields import Fields, read_fields
from robocal.instrument import InstrumentNoise
from robocal.planning.cell import PLANNED_NOISE, Box, Cell, Point, Station

_MM = 1e-3
_DEG = np.pi / 180.0


def read_cell(path: Path) -> Cell:
    """A cell from its file.

    Raises
    ------
    BadInput
        Naming line and field.
    """
    fields = read_fields(path)
    noise, sees_orientation = _noise(fields)
    cell = Cell(
        target=_point(fields, "target_mm") if "target_mm" in fields else Cell.target,
        box=_box(fields, "box_mm"),
        floor=_floor(fields),
        link_radius=_positive(fields, "link_radius_mm") if "link_radius_mm" in fields else None,
        station=_station(fields),
        noise=noise,
        sees_orientation=sees_orientation,
        workspace=_box(fields, "workspace_mm"),
        payloads=_payloads(fields),
    )
    fields.finish()
    return cell


def _point(fields: Fields, name: str) -> Point:
    x, y, z = (value * _MM for value in fields.numbers(name, 3))
    return x, y, z


def _positive(fields: Fields, name: str) -> float:
    value = fields.number(name)
    if value <= 0:
        raise fields.error(name, f"must be positive, not {value:g}")
    return value * _MM


def _box(fields: Fields, name: str) -> Box | None:
    if name not in fields:
        return None
    corners = fields.mapping(name)
    box = Box(_point(corners, "low"), _point(corners, "high"))
    corners.finish()
    if not all(low < high for low, high in zip(box.low, box.high, strict=True)):
        raise fields.error(name, "has a lower corner that is not below its upper corner")
    return box


def _floor(fields: Fields) -> float | None:
    if not fields.flag("floor", default=True):
        return None
    return fields.number("floor_mm") * _MM if "floor_mm" in fields else Cell.floor


def _station(fields: Fields) -> Station | None:
    if "tracker" not in fields:
        return None
    tracker = fields.mapping("tracker")
    position = _point(tracker, "xyz_mm")
    nearest, farthest = Station.nearest, Station.farthest
    if "range_mm" in tracker:
        nearest, farthest = (value * _MM for value in tracker.numbers("range_mm", 2))
    facing = Station.facing
    if "facing" in tracker:
        x, y, z = tracker.numbers("facing", 3)
        facing = (x, y, z)
        if not any(facing):
            raise tracker.error("facing", "must not be zero")
    acceptance = tracker.number("acceptance_deg", Station.acceptance / _DEG) * _DEG
    tracker.finish()
    return Station(position, nearest, farthest, facing, acceptance)


def _noise(fields: Fields) -> tuple[InstrumentNoise, bool]:
    noise, sees_orientation = _instrument(fields)
    if "repeatability" not in fields:
        return noise, sees_orientation
    stated = fields.mapping("repeatability")
    position, orientation = stated.number("sigma_mm"), stated.number("sigma_mrad", 0.0)
    if min(position, orientation) < 0:
        raise stated.error("sigma_mm", "and sigma_mrad must not be negative")
    stated.finish()
    repeated = replace(
        noise, repeatability=position * _MM, orientation_repeatability=orientation * 1e-3
    )
    return repeated, sees_orientation


def _instrument(fields: Fields) -> tuple[InstrumentNoise, bool]:
    if "instrument" not in fields:
        return PLANNED_NOISE, Cell.sees_orientation
    stated = fields.mapping("instrument")
    fixed = stated.deviation("sigma_mm", PLANNED_NOISE.fixed / _MM) * _MM
    per_range = stated.number("sigma_ppm", PLANNED_NOISE.per_range * 1e6) * 1e-6
    orientation = stated.deviation("sigma_mrad", PLANNED_NOISE.orientation * 1e3) * 1e-3
    if per_range < 0:
        raise stated.error("sigma_ppm", "must not be negative")
    sees = stated.text("sees", "pose" if Cell.sees_orientation else "position")
    if sees not in ("position", "pose"):
        raise stated.error("sees", f"must be position or pose, not '{sees}'")
    stated.finish()
    return InstrumentNoise(fixed, per_range, orientation), sees == "pose"


def _payloads(fields: Fields) -> tuple[float, float] | None:
    if "payloads_kg" not in fields:
        return None
    lighter, heavier = fields.numbers("payloads_kg", 2)
    if not 0 <= lighter < heavier:
        raise fields.error("payloads_kg", "must be two masses, the lighter first")
    return lighter, heavier

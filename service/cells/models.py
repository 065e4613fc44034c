"""A cell as it goes over HTTP."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, PositiveFloat, StringConstraints

CellName = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,62}$")]
Word = Annotated[str, StringConstraints(min_length=1, max_length=200)]


class Strict(BaseModel):
    """A request body in which an unknown field is an error."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class RobotSettings(Strict):
    """The robot of a cell and how to reach it."""

    model: Word
    """Name of a nominal robot, `ur10e`."""
    driver: Word
    address: Word


class TrackerSettings(Strict):
    """The instrument of a cell: how to reach it, and its standard uncertainty per axis."""

    driver: Word
    address: Word
    kind: Word = "laser_tracker"
    sigma_mm: PositiveFloat = 0.015
    sigma_ppm: Annotated[float, Field(ge=0)] = 6.0
    sigma_mrad: PositiveFloat = 0.05


class Limits(Strict):
    """How fast the robot may move in this cell; the leading joint counts."""

    speed_deg_s: Annotated[float, Field(gt=0, le=720)] = 60.0
    acceleration_deg_s2: Annotated[float, Field(gt=0, le=3600)] = 120.0
    full_speed_deg_s: Annotated[float, Field(gt=0, le=720)] = 180.0
    """What counts as full speed where a speed is given as a fraction."""


class NewCell(Strict):
    """A cell to be created."""

    name: CellName
    robot: RobotSettings
    tracker: TrackerSettings
    limits: Limits = Limits()


class Cell(NewCell):
    """A cell with its state."""

    armed: bool
    """An operator allows motion; ends with the campaign."""
    created: str


class Cells(BaseModel):
    """All cells."""

    cells: list[Cell]


class DeviceCheck(BaseModel):
    """Whether one device answered."""

    ok: bool
    detail: str


class CellCheck(BaseModel):
    """Whether the devices of a cell answered."""

    cell: str
    ok: bool
    robot: DeviceCheck
    tracker: DeviceCheck

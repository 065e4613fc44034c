"""A cell as it goes over HTTP."""

from datetime import date
from typing import Annotated, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    PositiveFloat,
    StringConstraints,
    model_validator,
)

CellName = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,62}$")]
Word = Annotated[str, StringConstraints(min_length=1, max_length=200)]
NestName = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,30}$")]
Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
Point = tuple[Coordinate, Coordinate, Coordinate]

MOST_SPEED_DEG_S = 90.0
"""From this speed a driver's stop takes 0.16 s: with the time to notice, less than 0.3 s in all."""


class Strict(BaseModel):
    """A request body in which an unknown field is an error."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class RobotSettings(Strict):
    """The robot of a cell and how to reach it."""

    model: Word
    """Name of a nominal robot, `ur10e`."""
    driver: Word
    address: Word


class StationSettings(Strict):
    """Where the tracker stands, in the robot's base frame, and what it can see."""

    xyz_mm: Point
    range_mm: tuple[Annotated[float, Field(ge=0)], PositiveFloat] = (0.0, 100_000.0)
    """Nearest and farthest target."""
    facing: Point = (0.0, 0.0, 1.0)
    """Where the target looks, in the flange frame."""
    acceptance_deg: Annotated[float, Field(gt=0, le=180)] = 180.0
    """Largest angle between that direction and the beam."""

    @model_validator(mode="after")
    def _has_an_inside(self) -> Self:
        if not self.range_mm[0] < self.range_mm[1]:
            raise ValueError("range_mm must have its shorter range first")
        if not any(self.facing):
            raise ValueError("facing must not be zero")
        return self


class CalibrationReference(Strict):
    """To what a device's own calibration is traced."""

    certificate: Word
    date: date
    laboratory: Word


class TrackerSettings(Strict):
    """The instrument of a cell: how to reach it, and its standard uncertainty per axis."""

    driver: Word
    address: Word
    kind: Word = "laser_tracker"
    sigma_mm: PositiveFloat = 0.015
    sigma_ppm: Annotated[float, Field(ge=0)] = 6.0
    sigma_mrad: PositiveFloat = 0.05
    spread_mm: PositiveFloat | None = None
    """Largest standard deviation of one reading's shots; by default five times what the
    instrument's uncertainty lets expect."""
    calibration: CalibrationReference | None = None
    """Of the instrument itself, for certificates."""
    station: StationSettings | None = None
    """Where it stands, so that poses are planned within its sight."""


class TemperatureProbeSettings(Strict):
    """A probe that is polled while a campaign runs."""

    driver: Word
    address: Word
    calibration: CalibrationReference | None = None


class StageSensorSettings(Strict):
    """One sensor of the calibration stage."""

    name: NestName
    """What it measures: `rod`, `slide`, `angle`."""
    driver: Word
    address: Word
    calibration: CalibrationReference | None = None


class NestSettings(Strict):
    """A reference nest that stands fixed beside the robot, its target always in it."""

    name: NestName
    xyz_mm: Point
    """About where, in the tracker's frame."""


class References(Strict):
    """Fixed nests that are measured again and again, to see the station drift."""

    nests: Annotated[list[NestSettings], Field(min_length=1, max_length=20)]
    every_poses: Annotated[int, Field(ge=1, le=10_000)] = 10
    """Readings of the robot between two visits of the nests."""
    every_s: PositiveFloat = 600.0
    """Longest time between two visits of the nests, on the robot's clock."""

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        names = [nest.name for nest in self.nests]
        if len(set(names)) < len(names):
            raise ValueError("two nests have the same name")
        return self


class Box(Strict):
    """A box along the axes of the robot's base frame."""

    low: Point
    high: Point

    @model_validator(mode="after")
    def _has_an_inside(self) -> Self:
        if not all(low < high for low, high in zip(self.low, self.high, strict=True)):
            raise ValueError("the lower corner must be below the upper one in x, y and z")
        return self


class Limits(Strict):
    """How fast and where the robot may move in this cell. Every motion is judged by these."""

    speed_deg_s: Annotated[float, Field(gt=0, le=MOST_SPEED_DEG_S)] = 30.0
    """Of the leading joint."""
    acceleration_deg_s2: Annotated[float, Field(gt=0, le=3600)] = 120.0
    full_speed_deg_s: Annotated[float, Field(gt=0, le=720)] = 180.0
    """What counts as full speed where a speed is given as a fraction."""
    joints: dict[str, tuple[float, float]] = {}
    """Narrower joint limits, by column name: `{"j1_deg": [-90, 90]}`."""
    workspace_mm: Box | None = None
    """The target stays inside."""
    floor_mm: float | None = 0.0
    """Height in the base frame that no part beyond the second joint goes below; null: no floor."""
    link_radius_mm: PositiveFloat | None = None
    """Of the capsules that stand for links and tool; by default a twentieth of the arm's length."""
    target_mm: Point | None = None
    """Where the target is on the flange; by default (50, 30, 100)."""


class CellSettings(Strict):
    """All of a cell but its name."""

    robot: RobotSettings
    tracker: TrackerSettings
    temperature_probe: TemperatureProbeSettings | None = None
    stage_sensors: Annotated[list[StageSensorSettings], Field(max_length=20)] = []
    references: References | None = None
    limits: Limits = Limits()

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        names = [sensor.name for sensor in self.stage_sensors]
        if len(set(names)) < len(names):
            raise ValueError("two stage sensors have the same name")
        return self


class NewCell(CellSettings):
    """A cell to be created."""

    name: CellName


class CellChange(Strict):
    """Sections of a cell to be replaced; those that are not given stay."""

    robot: RobotSettings | None = None
    tracker: TrackerSettings | None = None
    temperature_probe: TemperatureProbeSettings | None = None
    """null takes it away."""
    stage_sensors: Annotated[list[StageSensorSettings], Field(max_length=20)] | None = None
    references: References | None = None
    """null takes them away."""
    limits: Limits | None = None


class Cell(NewCell):
    """A cell with its state."""

    armed: bool
    """An operator allows motion; ends with the campaign, and with a change of the cell."""
    created: str


class Cells(BaseModel):
    """A page of cells, by name."""

    cells: list[Cell]
    next_after: str | None = None
    """`?after=` of the next page; null on the last one."""


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
    temperature_probe: DeviceCheck | None = None
    """null where the cell has none."""
    stage_sensors: dict[str, DeviceCheck] = {}

"""A base-to-base calibration as it goes over HTTP."""

from enum import StrEnum
from typing import Annotated, Any, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    Field,
    FiniteFloat,
    NonNegativeFloat,
    PositiveFloat,
    StringConstraints,
    model_validator,
)

from service.cells.models import CellName, RobotSettings, Strict, Word
from service.plain_text import plain

Millimetres = Annotated[float, Field(ge=-1e5, le=1e5)]
Degrees = Annotated[float, Field(ge=-360, le=360)]
Range = Annotated[tuple[Millimetres, Millimetres], Field(description="lower and upper end")]
AngleRange = Annotated[tuple[Degrees, Degrees], Field(description="lower and upper end")]
Reason = Annotated[
    str,
    StringConstraints(min_length=1, max_length=300, strip_whitespace=True),
    AfterValidator(plain),
]


class Role(StrEnum):
    """Which of the two robots."""

    master = "master"
    slave = "slave"


class Cup(StrEnum):
    """Which of the stage's two cups."""

    rod = "rod"
    slide = "slide"


class Geometry(StrEnum):
    """Which geometry of a robot is taken for true."""

    nominal = "nominal"
    released = "released"


class State(StrEnum):
    """How far a base calibration has come."""

    touching = "touching"
    finished = "finished"


class TouchingRobot(Strict):
    """One robot with its needle: of a cell, or described here."""

    cell: CellName | None = None
    robot: RobotSettings | None = None
    geometry: Geometry = Geometry.nominal
    """`released`: the identified model of the cell's released parameters."""
    needle_mm: tuple[Millimetres, Millimetres, Millimetres]
    """Needle tip in the flange frame."""
    sigma_mm: PositiveFloat | None = None
    """Standard uncertainty of a tip per axis."""
    sigma_joint_mrad: NonNegativeFloat | None = None

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.cell is None) == (self.robot is None):
            raise ValueError("give either cell or robot")
        if self.geometry is Geometry.released and self.cell is None:
            raise ValueError("released geometry is that of a cell: give cell")
        return self


class LengthSensor(Strict):
    """A sensor of the stage that reads a length."""

    driver: Word
    address: Word
    reversed: bool = False
    """Its reading falls where the stage's rises."""
    offset_mm: Millimetres = 0.0
    """Added to the reading after its sign."""


class AngleSensor(Strict):
    """A sensor of the stage that reads an angle."""

    driver: Word
    address: Word
    reversed: bool = False
    offset_deg: Degrees = 0.0


class Sensors(Strict):
    """The three sensors of the stage."""

    slide: LengthSensor
    rod_angle: AngleSensor
    rod_length: LengthSensor


class StageSettings(Strict):
    """The stage as the file stage.yaml describes it, and its sensors."""

    sensors: Sensors | None = None
    """By default those of the master's cell, named slide, angle and rod."""
    sigma_slide_mm: PositiveFloat = 0.05
    sigma_rod_mm: PositiveFloat = 0.02
    sigma_angle_mrad: PositiveFloat = 0.1
    level_in_master: bool = False
    level_in_slave: bool = False
    sigma_level_mrad: PositiveFloat | None = None
    prior_std: Annotated[dict[str, NonNegativeFloat], Field(default_factory=dict)]
    """Of sensor corrections, by their names in basecal.json."""
    slide_range_mm: Range
    rod_angle_range_deg: AngleRange = (-90.0, 90.0)
    rod_length_range_mm: Range

    @model_validator(mode="after")
    def _rising(self) -> Self:
        for name in ("slide_range_mm", "rod_angle_range_deg", "rod_length_range_mm"):
            low, high = getattr(self, name)
            if low >= high:
                raise ValueError(f"{name}: the lower end {low:g} is not below {high:g}")
        if self.rod_length_range_mm[0] <= 0:
            raise ValueError("rod_length_range_mm: a rod is longer than zero")
        return self


class NewBaseCalibration(Strict):
    """A base calibration to be started."""

    name: CellName
    """Of the pair of robots: the versions of its transform count under this name."""
    master: TouchingRobot
    slave: TouchingRobot
    stage: StageSettings


class NewTouch(Strict):
    """A touch to be taken: the needle sits in the cup, robot and stage stand still."""

    robot: Role
    cup: Cup
    stage_moved: bool = False
    """The stage was set down anew, or turned, since the touch before."""


class Voiding(Strict):
    """Why a touch is not to count."""

    reason: Reason


class Touch(BaseModel):
    """One touch as it was read."""

    number: int
    robot: Role
    cup: Cup
    placement: int
    joints: dict[str, FiniteFloat]
    """By column name, `j1_deg`."""
    slide_mm: FiniteFloat
    rod_angle_deg: FiniteFloat
    rod_length_mm: FiniteFloat
    slide_spread_mm: FiniteFloat
    rod_angle_spread_mrad: FiniteFloat
    rod_length_spread_mm: FiniteFloat
    readings: int
    """Of each sensor, in the mean."""
    taken: str
    voided: str | None
    """When it was voided; it is kept and does not count."""
    void_reason: str


class Step(StrEnum):
    """Which touch of the procedure; the first four are those of the paper's figure 2."""

    p1 = "P1"
    p2 = "P2"
    r1 = "R1"
    r2 = "R2"
    best = "best"


class NextTouch(BaseModel):
    """The touch to make next, and why."""

    step: Step
    robot: Role
    cup: Cup
    slide_mm: FiniteFloat
    rod_angle_deg: FiniteFloat | None
    rod_length_mm: FiniteFloat | None
    place_mm: tuple[float, float, float] | None
    """Where the cup then is in the touching robot's base, where that is known."""
    uncertainty_before_mm: FiniteFloat | None
    uncertainty_after_mm: FiniteFloat | None
    why: str


class BaseCalibrationHead(BaseModel):
    """A base calibration in a list."""

    id: int
    name: str
    state: State
    touches: int
    """Those that count."""
    version: int | None
    """Of the transform that it made."""
    created: str
    finished: str | None


class BaseCalibrations(BaseModel):
    """Base calibrations, newest first."""

    base_calibrations: list[BaseCalibrationHead]


class BaseCalibration(BaseModel):
    """A base calibration with its touches and what they say so far."""

    id: int
    name: str
    state: State
    revision: int
    """Grows with every touch taken or voided."""
    settings: NewBaseCalibration
    touches: list[Touch]
    may_finish: bool
    next_touch: NextTouch | None
    assessment: dict[str, Any] | None
    """As in basecal.json, once each robot has touched twice."""
    no_answer: str
    """Why there is no assessment where the numbers do not allow one."""
    version: int | None
    created: str
    finished: str | None


class SensorView(BaseModel):
    """What one sensor says at this moment, over its latest readings."""

    sensor: str
    unit: str
    mean: FiniteFloat | None
    spread: FiniteFloat | None
    allowed_spread: FiniteFloat
    readings: int
    age_s: FiniteFloat | None
    """Since the latest reading."""
    steady: bool
    """Fresh, and no more spread than allowed."""
    problem: str
    """What keeps it from being read."""


class SensorViews(BaseModel):
    """The three sensors."""

    sensors: list[SensorView]


class Finished(BaseModel):
    """What finishing made."""

    id: int
    name: str
    version: int


class TransformState(StrEnum):
    """How far a version has come."""

    candidate = "candidate"
    released = "released"
    superseded = "superseded"


class BaseTransform(BaseModel):
    """One version of where a slave's base stands in its master's."""

    name: str
    version: int
    state: TransformState
    base_calibration: int
    bundle_sha256: str
    software_version: str
    created: str
    released: str | None
    result: dict[str, Any]
    """basecal.json"""


class BaseTransformHead(BaseModel):
    """A version in a list."""

    version: int
    state: TransformState
    base_calibration: int
    created: str
    released: str | None


class TransformEvent(StrEnum):
    """A step in the life of a version."""

    made = "made"
    released = "released"
    superseded = "superseded"
    rolled_back = "rolled_back"


class TransformStep(BaseModel):
    """Who did what to a version, and when."""

    version: int
    event: TransformEvent
    person: str
    reason: str
    at: str


class BaseTransforms(BaseModel):
    """All versions of a pair, newest first."""

    name: str
    versions: list[BaseTransformHead]
    history: list[TransformStep]
    """Newest first."""

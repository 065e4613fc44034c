"""A campaign as it goes over HTTP."""

from enum import StrEnum
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, PositiveFloat, PositiveInt

from service.cells.models import CellName, Strict

MOST_POSES = 10_000

JointColumns = Annotated[dict[str, float], Field(min_length=1)]
"""One pose, by the column names of measurements.csv: `{"j1_deg": 10, ..., "j3_mm": 50}`."""


class CampaignKind(StrEnum):
    """What a campaign is for."""

    calibrate = "calibrate"
    verify = "verify"
    health = "health"
    follow_up = "follow_up"


class CampaignState(StrEnum):
    """Where a campaign stands."""

    queued = "queued"
    running = "running"
    paused = "paused"
    finished = "finished"
    aborted = "aborted"
    failed = "failed"


ENDED = frozenset({CampaignState.finished, CampaignState.aborted, CampaignState.failed})


class CriterionSettings(Strict):
    """What a verification must reach for its version to count as verified (ISO 9283)."""

    pose_accuracy_mean_mm: PositiveFloat = 0.25
    """Largest mean of the pose accuracies AP_p."""
    pose_accuracy_max_mm: PositiveFloat = 0.5
    """Largest single AP_p."""
    poses: PositiveInt = 5
    """Fewest poses on which it is judged."""


class NewCampaign(Strict):
    """A campaign to be driven."""

    cell: CellName
    kind: CampaignKind
    poses: (
        Annotated[int, Field(ge=1, le=MOST_POSES)]
        | Annotated[list[JointColumns], Field(min_length=1, max_length=MOST_POSES)]
        | None
    ) = None
    """A number, to have the poses planned, or the poses themselves. A follow-up drives those that
    the diagnosis asks for, at most this many a round; its own ones may be given."""
    follows: Annotated[int, Field(ge=1, lt=2**31)] | None = None
    """The campaign whose diagnosis a follow-up is to make surer."""
    rounds: Annotated[int, Field(ge=1, le=10)] | None = None
    """How often a follow-up diagnoses and asks for further poses while causes remain open."""
    repeats: Annotated[int, Field(ge=1, le=100)] = 1
    """How often the whole series is driven: a repeat is a new visit, not a second look."""
    settle_s: Annotated[float, Field(ge=0, le=600)] = 0.5
    """Least time between standing still and reading, on the robot's clock."""
    approach_deg: Annotated[float, Field(ge=0, le=20)] = 2.0
    """How far before each pose every joint begins its last move, from a side that changes with
    poses and repeats; 0: it comes straight from the pose before."""
    approach_mm: Annotated[float, Field(ge=0, le=50)] = 5.0
    """The same of a sliding joint."""
    payload_kg: Annotated[float, Field(ge=0, le=10_000)] | None = None
    """What the robot carries beside its own links; null: as much as in the campaign that it follows
    or checks, not known if that states none."""
    seed: Annotated[int, Field(ge=0, lt=2**31)] | None = None
    """Of planning and of the held-out rows; the campaign's number if not given."""
    parameters_version: Annotated[int, Field(ge=1, lt=2**31)] | None = None
    """Which version a verification is about; the newest that is not superseded if not given."""
    criterion: CriterionSettings | None = None
    """Of a verification."""


class Accepted(BaseModel):
    """The answer to a request that goes on by itself."""

    id: int
    state: CampaignState


class Resumption(Strict):
    """How to go on."""

    skip_pose: bool = False
    """Leave out the pose at which the campaign stands."""


class Repeatable(StrEnum):
    """Results that can be computed again."""

    identification = "identification"
    diagnosis = "diagnosis"


ParameterName = Annotated[str, Field(pattern=r"^[a-z_]+[a-z0-9_]*$", max_length=40)]


OwnPrior = Annotated[str, Field(pattern=r"^[a-z0-9_]+=[0-9.eE+-]+$", max_length=60)]


class IdentificationWish(Strict):
    """Settings of an identification, as `robocal identify` takes them."""

    strategy: Literal["cross", "simultaneous"] = "simultaneous"
    fix: Annotated[tuple[ParameterName, ...], Field(max_length=200)] = ()
    """Parameters that keep their nominal value: `d_4`."""
    free: Annotated[tuple[ParameterName, ...], Field(max_length=200)] = ()
    """Parameters without a prior: `a_2`."""
    prior: Annotated[tuple[OwnPrior, ...], Field(max_length=200)] = ()
    """Own standard deviations: `a_2_mm=0.2`."""


class Computation(BaseModel):
    """A result that is computed again."""

    id: int
    campaign: int
    result: Repeatable
    settings: dict[str, Any]
    state: str
    """queued, running, done, failed, cancelled"""
    reason: str
    """Why it failed."""
    created: str
    finished: str | None


class Campaign(BaseModel):
    """A campaign and its progress."""

    id: int
    cell: str | None
    kind: CampaignKind
    state: CampaignState
    done: int
    """Readings taken, of `total`."""
    total: int
    skipped: int
    """Poses left out; `/poses` says why."""
    remaining_s: float | None
    """Estimated from the readings so far; null before the first."""
    reason: str
    """Why it is paused or failed, and what to do."""
    revision: int
    repeats: int
    settle_s: float
    payload_kg: float | None = None
    """What the robot carries beside its own links; null: not known."""
    seed: int
    parameters_version: int | None
    criterion: CriterionSettings | None = None
    """What a verification must reach."""
    follows: int | None = None
    rounds: int = 1
    created: str
    started: str | None
    finished: str | None


class Campaigns(BaseModel):
    """A page of campaigns, newest first."""

    campaigns: list[Campaign]
    next_before: int | None
    """`?before=` of the next page; null on the last one."""


class PoseState(StrEnum):
    """What became of a pose."""

    planned = "planned"
    measured = "measured"
    skipped = "skipped"


class Pose(BaseModel):
    """One pose of a campaign's plan."""

    pose: int
    state: PoseState
    purpose: str
    attempts: int
    """How often the robot was sent there, over all repeats."""
    reason: str
    """Why it was skipped."""
    joints: dict[str, float]
    """Commanded, by column name."""


class Poses(BaseModel):
    """The poses of a campaign in the order of the visits."""

    campaign: int
    poses: list[Pose]


class Measurements(BaseModel):
    """Rows of measurements.csv as objects; a missing value is null."""

    campaign: int
    columns: list[str]
    rows: list[dict[str, float | str | None]]


class ResultDocument(BaseModel):
    """identification.json, uncertainty.json or the verification, as the commands write it."""

    model_config = ConfigDict(extra="allow")


Json = dict[str, Any]

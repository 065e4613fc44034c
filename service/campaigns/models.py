"""A campaign as it goes over HTTP."""

from enum import StrEnum
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

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


class NewCampaign(Strict):
    """A campaign to be driven."""

    cell: CellName
    kind: CampaignKind
    poses: (
        Annotated[int, Field(ge=1, le=MOST_POSES)]
        | Annotated[list[JointColumns], Field(min_length=1, max_length=MOST_POSES)]
    )
    """A number, to have the poses planned, or the poses themselves."""
    repeats: Annotated[int, Field(ge=1, le=100)] = 1
    """How often the whole series is driven: a repeat is a new visit, not a second look."""
    settle_s: Annotated[float, Field(ge=0, le=600)] = 0.5
    """Least time between standing still and reading, on the robot's clock."""
    seed: Annotated[int, Field(ge=0, lt=2**31)] | None = None
    """Of planning and of the held-out rows; the campaign's number if not given."""


class Accepted(BaseModel):
    """The answer to a request that goes on by itself."""

    id: int
    state: CampaignState


class Resumption(Strict):
    """How to go on."""

    skip_pose: bool = False
    """Leave out the pose at which the campaign stands."""


class Campaign(BaseModel):
    """A campaign and its progress."""

    id: int
    cell: str | None
    kind: CampaignKind
    state: CampaignState
    done: int
    """Readings taken, of `total`."""
    total: int
    remaining_s: float | None
    """Estimated from the readings so far; null before the first."""
    reason: str
    """Why it is paused or failed, and what to do."""
    revision: int
    repeats: int
    settle_s: float
    seed: int
    parameters_version: int | None
    created: str
    started: str | None
    finished: str | None


class Campaigns(BaseModel):
    """A page of campaigns, newest first."""

    campaigns: list[Campaign]
    next_before: int | None
    """`?before=` of the next page; null on the last one."""


class Measurements(BaseModel):
    """Rows of measurements.csv as objects; a missing value is null."""

    campaign: int
    columns: list[str]
    rows: list[dict[str, float | str | None]]


class ResultDocument(BaseModel):
    """identification.json, uncertainty.json or the verification, as the commands write it."""

    model_config = ConfigDict(extra="allow")


Json = dict[str, Any]

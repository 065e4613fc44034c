"""Compensated parameters as the cell's MES reads them."""

from enum import StrEnum
from typing import Annotated, Any

from pydantic import BaseModel, Field

from service.cells.models import Strict
from service.plain_text import PlainText


class ParametersState(StrEnum):
    """How far a version has come."""

    candidate = "candidate"
    verified = "verified"
    released = "released"
    superseded = "superseded"


class LifeEvent(StrEnum):
    """What can happen to a version."""

    computed = "computed"
    verified = "verified"
    verification_failed = "verification_failed"
    released = "released"
    rolled_back = "rolled_back"
    superseded = "superseded"


class Origin(BaseModel):
    """From which readings a step came, and how it is computed again."""

    bundle_sha256: str | None = None
    software_version: str | None = None
    settings: dict[str, Any] = {}
    seed: int | None = None


class Provenance(BaseModel):
    """From what the parameters were computed."""

    campaign: int
    bundle_sha256: str
    software_version: str
    computed: str
    settings: dict[str, Any] = {}
    """Of the computation: strategy and the like."""
    seed: int | None = None
    """Of planning and of the held-out rows."""


class ParametersContent(BaseModel):
    """What is stored of a version; never changes."""

    parameters: list[dict[str, Any]]
    """As in identification.json: name, unit, nominal, identified, std, status."""
    base: dict[str, Any]
    tool: dict[str, Any]
    residuals: dict[str, Any]
    uncertainty: dict[str, Any]
    model: dict[str, Any]
    """Contents of model.yaml: enough to predict and compensate."""
    provenance: Provenance


class Parameters(ParametersContent):
    """One version of a cell's parameters, each with its standard uncertainty."""

    cell: str
    version: int
    state: ParametersState
    created: str
    released: str | None


class VersionSummary(BaseModel):
    """A version without its numbers."""

    cell: str
    version: int
    state: ParametersState
    campaign: int
    bundle_sha256: str
    created: str
    released: str | None


class Versions(BaseModel):
    """A page of versions, newest first."""

    versions: list[VersionSummary]
    next_before: int | None
    """`?before=` of the next page; null on the last one."""


class LifeStep(BaseModel):
    """One step in the life of a version."""

    id: int
    version: int
    event: LifeEvent
    person: str | None
    """Null where a campaign did it by itself."""
    reason: str
    campaign: int | None
    """Whose readings led to it."""
    origin: Origin
    at: str


class History(BaseModel):
    """A page of steps, newest first."""

    cell: str
    history: list[LifeStep]
    next_before: int | None
    """`?before=` of the next page; null on the last one."""


class Decision(Strict):
    """Why a person releases or rolls back."""

    reason: Annotated[PlainText, Field(max_length=1000)] = ""
    """Required for what somebody has to answer for: a version that no verification has passed, a
    base calibration that leaves directions open or holds a fault that stays."""

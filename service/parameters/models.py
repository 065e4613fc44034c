"""Compensated parameters as the cell's MES reads them."""

from enum import StrEnum
from typing import Any

from pydantic import BaseModel


class ParametersState(StrEnum):
    """How far a version has come."""

    candidate = "candidate"
    released = "released"
    superseded = "superseded"


class Provenance(BaseModel):
    """From what the parameters were computed."""

    campaign: int
    bundle_sha256: str
    software_version: str
    computed: str


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

"""What a certificate states, gathered from the database alone and in a fixed order."""

import hashlib
import json
from dataclasses import dataclass
from typing import Any

import yaml
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.campaigns import life, results
from service.campaigns.results import ResultKind
from service.db.models import (
    BundleRow,
    CampaignRow,
    ParametersEventRow,
    ParametersRow,
    ReadingRow,
    ResultRow,
)
from service.errors import Conflict
from service.parameters.models import ParametersState

Json = dict[str, Any]

_FURTHEST = (
    ParametersState.candidate,
    ParametersState.verified,
    ParametersState.superseded,
    ParametersState.released,
)
COVERAGE = 2.0
"""Factor k of the expanded uncertainties, about 95 %; [1]"""


@dataclass(frozen=True)
class Parameter:
    """One identified number."""

    name: str
    unit: str
    nominal: float
    identified: float
    expanded: float | None
    """U with `COVERAGE`; None where the parameter was not identified."""
    status: str


@dataclass(frozen=True)
class Instrument:
    """A device and what its own calibration is traced to."""

    role: str
    device: str
    reference: str


@dataclass(frozen=True)
class Environment:
    """What it was like while it was measured."""

    readings: int
    first: str
    last: str
    temperature_degc: tuple[float, float] | None


@dataclass(frozen=True)
class Hashed:
    """A document by its hash."""

    what: str
    sha256: str


@dataclass(frozen=True)
class Contents:
    """Everything that stands in a certificate."""

    issued: str
    """When the newest of what it states came about: a result, or a step of the parameters."""
    cell: str
    robot: str
    version: int | None
    state: str
    instruments: tuple[Instrument, ...]
    environment: Environment
    campaign: CampaignRow
    identification: Json
    parameters: tuple[Parameter, ...]
    software_version: str
    settings: Json
    verification: Json | None
    verified_by: int | None
    uncertainty: Json
    diagnosis: Json | None
    hashes: tuple[Hashed, ...]


def contents(session: Session, number: int) -> Contents:
    """What the certificate of a calibration states; raises `NotFound`, `Conflict`."""
    campaign = life.find(session, number)
    found = results.newest(session, number, ResultKind.identification)
    uncertainty = results.newest(session, number, ResultKind.uncertainty)
    parameters = _parameters(session, number)
    verification = None if parameters is None else _verification(session, parameters)
    diagnosis = _newest(session, number, "diagnosis")
    parts = [row for row in (found, uncertainty, verification, diagnosis) if row is not None]
    hashes = _hashes(found, parts)
    return Contents(
        issued=max([row.created for row in parts] + _steps(session, parameters)),
        cell=campaign.cell or "none (imported)",
        robot=_robot_name(found),
        version=None if parameters is None else parameters.version,
        state="not stored for a cell" if parameters is None else parameters.state,
        instruments=_instruments(campaign.cell_document or {}),
        environment=_environment(session, campaign),
        campaign=campaign,
        identification=found.document,
        parameters=tuple(_parameter(entry) for entry in found.document["parameters"]),
        software_version=found.software_version,
        settings=found.settings,
        verification=None if verification is None else verification.document,
        verified_by=None if verification is None else verification.campaign,
        uncertainty=uncertainty.document,
        diagnosis=None if diagnosis is None else diagnosis.document,
        hashes=hashes,
    )


def _parameters(session: Session, campaign: int) -> ParametersRow | None:
    """The version that the certificate is about: the one that came furthest, then the newest."""
    rows = session.scalars(select(ParametersRow).where(ParametersRow.campaign == campaign))
    return max(rows, key=lambda row: (_FURTHEST.index(row.state), row.version), default=None)


def _verification(session: Session, parameters: ParametersRow) -> ResultRow | None:
    """The newest verification of these very parameters."""
    return session.scalars(
        select(ResultRow)
        .join(CampaignRow, CampaignRow.id == ResultRow.campaign)
        .where(
            CampaignRow.cell == parameters.cell,
            CampaignRow.parameters_version == parameters.version,
            ResultRow.kind == ResultKind.verification,
        )
        .order_by(ResultRow.id.desc())
        .limit(1)
    ).first()


def _steps(session: Session, parameters: ParametersRow | None) -> list[str]:
    """When the version became what it is now."""
    if parameters is None:
        return []
    of_version = (
        ParametersEventRow.cell == parameters.cell,
        ParametersEventRow.version == parameters.version,
    )
    return list(session.scalars(select(ParametersEventRow.at).where(*of_version)))


def _newest(session: Session, campaign: int, kind: str) -> ResultRow | None:
    return session.scalars(
        select(ResultRow)
        .where(ResultRow.campaign == campaign, ResultRow.kind == kind)
        .order_by(ResultRow.id.desc())
        .limit(1)
    ).first()


def _robot_name(found: ResultRow) -> str:
    if found.model_yaml is None:
        raise Conflict("The identification has no model; identify again.")
    return str(yaml.safe_load(found.model_yaml)["robot"]["name"])


def _parameter(entry: Json) -> Parameter:
    std = entry.get("std")
    return Parameter(
        name=entry["name"],
        unit=entry["unit"],
        nominal=entry["nominal"],
        identified=entry["identified"],
        expanded=None if not std else COVERAGE * std,
        status=entry["status"],
    )


def _instruments(cell: Json) -> tuple[Instrument, ...]:
    """Devices of the cell as it was when the campaign was made."""
    devices = [
        ("tracker", cell.get("tracker")),
        ("temperature probe", cell.get("temperature_probe")),
    ]
    devices += [(f"sensor {one['name']}", one) for one in cell.get("stage_sensors") or []]
    return tuple(
        Instrument(role, device["driver"], _reference(device.get("calibration")))
        for role, device in devices
        if device
    )


def _reference(calibration: Json | None) -> str:
    if not calibration:
        return "not stated"
    return (
        f"certificate {calibration['certificate']} of {calibration['date']}, "
        f"{calibration['laboratory']}"
    )


def _environment(session: Session, campaign: CampaignRow) -> Environment:
    if session.get(BundleRow, campaign.id) is not None:
        return Environment(campaign.pose_count, campaign.created, campaign.created, None)
    count, first, last, coldest, warmest = session.execute(
        select(
            func.count(),
            func.min(ReadingRow.created),
            func.max(ReadingRow.created),
            func.min(ReadingRow.temperature_degc),
            func.max(ReadingRow.temperature_degc),
        ).where(ReadingRow.campaign == campaign.id)
    ).one()
    range_degc = None if coldest is None or warmest is None else (coldest, warmest)
    return Environment(count, first or "", last or "", range_degc)


def _hashes(found: ResultRow, parts: list[ResultRow]) -> tuple[Hashed, ...]:
    model = hashlib.sha256((found.model_yaml or "").encode()).hexdigest()
    hashes = [Hashed("readings (bundle)", found.bundle_sha256), Hashed("model.yaml", model)]
    for row in parts:
        text = json.dumps(row.document, sort_keys=True, separators=(",", ":"))
        hashes.append(Hashed(f"{row.kind}.json", hashlib.sha256(text.encode()).hexdigest()))
    return tuple(hashes)

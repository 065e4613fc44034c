"""What a certificate states, gathered from the database alone and in a fixed order."""

import hashlib
import json
from dataclasses import dataclass
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.campaigns import life
from service.campaigns.results import ResultKind
from service.certificate.subject import Subject, subject
from service.db.models import (
    BundleRow,
    CampaignRow,
    ParametersEventRow,
    ParametersRow,
    ReadingRow,
    ResultRow,
)

Json = dict[str, Any]

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
    fit: Json | None
    """The identification; None for parameters that a diagnosis gave."""
    effects: tuple[Json, ...]
    """Those in the model, as it names them."""
    residuals: Json
    parameters: tuple[Parameter, ...]
    software_version: str
    verification: Json | None
    verified_by: int | None
    uncertainty: Json
    diagnosis: Json | None
    hashes: tuple[Hashed, ...]


def contents(session: Session, number: int, version: int | None = None) -> Contents:
    """What the certificate of a calibration states; raises `NotFound`, `Conflict`.

    Of the version asked for, else of the one that came furthest, and of no other.
    """
    campaign = life.find(session, number)
    about = subject(session, number, version)
    row = about.row
    verification = None if row is None else _verification(session, row)
    diagnosis = _diagnosis(session, about.result)
    parts = [part for part in (about.result, verification, diagnosis) if part is not None]
    return Contents(
        issued=max([part.created for part in parts] + _steps(session, row)),
        cell=campaign.cell or "none (imported)",
        robot=str(about.model["robot"]["name"]),
        version=None if row is None else row.version,
        state="not stored for a cell" if row is None else row.state,
        instruments=_instruments(campaign.cell_document or {}),
        environment=_environment(session, campaign),
        campaign=campaign,
        fit=about.fit,
        effects=tuple(about.model.get("effects", ())),
        residuals=about.residuals,
        parameters=tuple(_parameter(entry) for entry in about.parameters),
        software_version=about.result.software_version,
        verification=None if verification is None else verification.document,
        verified_by=None if verification is None else verification.campaign,
        uncertainty=about.uncertainty,
        diagnosis=None if diagnosis is None else diagnosis.document,
        hashes=_hashes(about, verification, diagnosis),
    )


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


def _diagnosis(session: Session, result: ResultRow) -> ResultRow | None:
    """The diagnosis that gave the parameters, else the newest one of the same readings."""
    if result.kind == ResultKind.diagnosis:
        return result
    return session.scalars(
        select(ResultRow)
        .where(
            ResultRow.campaign == result.campaign,
            ResultRow.kind == ResultKind.diagnosis,
            ResultRow.bundle_sha256 == result.bundle_sha256,
        )
        .order_by(ResultRow.id.desc())
        .limit(1)
    ).first()


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


def _hashes(
    about: Subject, verification: ResultRow | None, diagnosis: ResultRow | None
) -> tuple[Hashed, ...]:
    result = about.result
    model = hashlib.sha256((result.model_yaml or "").encode()).hexdigest()
    documents = [
        (ResultKind.identification, about.fit),
        (ResultKind.uncertainty, about.uncertainty),
    ]
    documents += [
        (ResultKind(row.kind), row.document) for row in (verification, diagnosis) if row is not None
    ]
    hashes = [Hashed("readings (bundle)", result.bundle_sha256), Hashed("model.yaml", model)]
    for kind, document in documents:
        if document is not None:
            text = json.dumps(document, sort_keys=True, separators=(",", ":"))
            hashes.append(Hashed(f"{kind}.json", hashlib.sha256(text.encode()).hexdigest()))
    return tuple(hashes)

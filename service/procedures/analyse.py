"""From the readings of a campaign to its results: nothing moves."""

import io
import zipfile
from importlib.metadata import version

import yaml
from sqlalchemy import select
from sqlalchemy.orm import Session

from service.campaigns import measurements
from service.campaigns.models import CampaignKind
from service.campaigns.results import ResultKind
from service.clock import utc_now
from service.db.models import BundleRow, CampaignRow, PoseRow, ReadingRow, ResultRow
from service.parameters import store as parameters
from service.parameters.models import ParametersContent, Provenance
from service.procedures.computation import Json, compute
from service.procedures.job import Job
from service.procedures.plan import MODEL, PURPOSE_NOMINAL, model_to_verify


def analyse(job: Job) -> None:
    """Compute and store what the campaign is for, and end it, in one transaction."""
    with job.database.read() as session:
        row = session.get_one(CampaignRow, job.campaign)
        kind = CampaignKind(row.kind)
        files = _bundle_files(session, row)
        request: Json = {"date": utc_now()}
        if kind is CampaignKind.verify:
            files[MODEL] = model_to_verify(session, row)
            request = _both_visits(session, row)
    answer = compute(kind, files, request, job.watch)
    with job.database.write() as session:
        job.queue.hold_fence(session, job.claim)
        if kind is CampaignKind.verify:
            _add_result(session, job, ResultKind.verification, answer)
        else:
            _store_calibration(session, job, answer)
        job.life.finish(session)


def _bundle_files(session: Session, row: CampaignRow) -> dict[str, bytes]:
    imported = session.get(BundleRow, row.id)
    if imported is None:
        return measurements.bundle_files(session, row)
    with zipfile.ZipFile(io.BytesIO(imported.content)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def _both_visits(session: Session, row: CampaignRow) -> Json:
    """Pair the visits to each target: nominal joints, then the positions reached either way."""
    nominal: dict[tuple[int, int], ReadingRow] = {}
    compensated: dict[tuple[int, int], ReadingRow] = {}
    for reading, purpose in session.execute(
        select(ReadingRow, PoseRow.purpose)
        .join(PoseRow, (PoseRow.campaign == ReadingRow.campaign) & (PoseRow.idx == ReadingRow.idx))
        .where(ReadingRow.campaign == row.id)
        .order_by(ReadingRow.repeat, ReadingRow.idx)
    ):
        side = nominal if purpose == PURPOSE_NOMINAL else compensated
        side[reading.idx // 2, reading.repeat] = reading
    # A target of which a person skipped one visit shows nothing.
    targets = [target for target in nominal if target in compensated]
    return {
        "nominal_joints": [nominal[target].commanded for target in targets],
        "nominal_positions": [nominal[target].position for target in targets],
        "compensated_positions": [compensated[target].position for target in targets],
    }


def _store_calibration(session: Session, job: Job, answer: Json) -> None:
    identification = _add_result(session, job, ResultKind.identification, answer)
    _add_result(session, job, ResultKind.uncertainty, answer)
    if job.claim.cell is None:
        return
    document = answer["identification"]
    content = ParametersContent(
        parameters=document["parameters"],
        base=document["base"],
        tool=document["tool"],
        residuals=document["residuals"],
        uncertainty=answer["uncertainty"],
        model=answer["model"],
        provenance=Provenance(
            campaign=job.campaign,
            bundle_sha256=identification.bundle_sha256,
            software_version=identification.software_version,
            computed=identification.created,
        ),
    )
    parameters.add_candidate(session, job.claim.cell, job.campaign, content)


def _add_result(session: Session, job: Job, kind: ResultKind, answer: Json) -> ResultRow:
    model_yaml = None
    if kind is ResultKind.identification:
        model_yaml = yaml.safe_dump(answer["model"], sort_keys=False)
    row = ResultRow(
        campaign=job.campaign,
        kind=kind,
        document=answer[kind],
        model_yaml=model_yaml,
        bundle_sha256=answer["bundle_sha256"],
        software_version=version("robocal"),
        settings=answer["settings"],
        created=utc_now(),
    )
    session.add(row)
    session.flush()
    return row

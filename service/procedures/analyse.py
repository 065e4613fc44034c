"""From the readings of a campaign to its results: nothing moves."""

import io
import zipfile
from importlib.metadata import version

import yaml
from sqlalchemy.orm import Session

from service.campaigns import measurements
from service.campaigns.models import CampaignKind
from service.campaigns.results import ResultKind
from service.clock import utc_now
from service.db.models import BundleRow, CampaignRow, ResultRow
from service.jobs.queue import JobKind
from service.parameters import store as parameters
from service.parameters.models import ParametersContent, Provenance
from service.procedures.computation import Json, NumericsFailed, compute
from service.procedures.health import health_request, store_health
from service.procedures.job import Job
from service.procedures.left_open import said_of_poses
from service.procedures.plan import MODEL, model_to_verify
from service.procedures.verification import store_verification, verification_request


def analyse(job: Job) -> None:
    """Compute and store what the campaign is for, and end it, in one transaction."""
    with job.database.read() as session:
        row = session.get_one(CampaignRow, job.campaign)
        kind = CampaignKind(row.kind)
        files = campaign_files(session, row)
        request: Json = {"date": utc_now()}
        if kind is CampaignKind.verify:
            files[MODEL] = model_to_verify(session, row)
            request = verification_request(session, row)
        elif kind is CampaignKind.health:
            files[MODEL] = model_to_verify(session, row)
            request = health_request(session, row)
    operation = CampaignKind.calibrate if kind is CampaignKind.follow_up else kind
    try:
        answer = compute(operation, files, request, job.watch)
    except NumericsFailed as failed:
        raise NumericsFailed(f"{failed}{said_of_poses(job)}") from failed
    with job.database.write() as session:
        job.queue.hold_fence(session, job.claim)
        if kind is CampaignKind.verify:
            result = add_result(session, job, ResultKind.verification, answer)
            store_verification(session, session.get_one(CampaignRow, job.campaign), result)
            job.life.finish(session)
        elif kind is CampaignKind.health:
            result = add_result(session, job, ResultKind.health, answer)
            store_health(session, session.get_one(CampaignRow, job.campaign), result)
            job.life.finish(session)
        else:
            store_calibration(session, job, answer)
            job.life.go_on(session, JobKind.diagnose)


def campaign_files(session: Session, row: CampaignRow) -> dict[str, bytes]:
    """Return the bundle of a campaign, driven or imported."""
    imported = session.get(BundleRow, row.id)
    if imported is None:
        return measurements.bundle_files(session, row)
    with zipfile.ZipFile(io.BytesIO(imported.content)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def store_calibration(session: Session, job: Job, answer: Json) -> None:
    """Store identification and uncertainty, and the version of parameters that comes of them."""
    identification = add_result(session, job, ResultKind.identification, answer)
    add_result(session, job, ResultKind.uncertainty, answer)
    document = answer["identification"]
    parts = {name: document[name] for name in ("parameters", "base", "tool", "residuals")}
    parts |= {"uncertainty": answer["uncertainty"], "model": answer["model"]}
    add_candidate(session, identification, parts)


def add_candidate(session: Session, result: ResultRow, parts: Json) -> None:
    """Make a version of the cell's parameters from a result, if the campaign has a cell."""
    campaign = session.get_one(CampaignRow, result.campaign)
    if campaign.cell is None:
        return
    provenance = Provenance(
        campaign=campaign.id,
        bundle_sha256=result.bundle_sha256,
        software_version=result.software_version,
        computed=result.created,
        settings=result.settings,
        seed=campaign.seed,
    )
    content = ParametersContent(**parts, provenance=provenance)
    parameters.add_candidate(session, campaign.cell, campaign.id, content)


def add_result(session: Session, job: Job, kind: ResultKind, answer: Json) -> ResultRow:
    """Store one result with all that is needed to compute it again."""
    model_yaml = None
    if kind in {ResultKind.identification, ResultKind.diagnosis}:
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

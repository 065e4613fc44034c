"""Diagnose a campaign; a follow-up then drives on while causes are open."""

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.campaigns import follow_ups, results
from service.campaigns.follow_ups import NEXT_JOINTS, FollowUpPoses
from service.campaigns.models import CampaignKind, Repeatable
from service.campaigns.repeats import RepeatSide
from service.campaigns.results import ResultKind
from service.clock import utc_now
from service.db.models import CampaignRow, ResultFileRow, ResultRow
from service.jobs.queue import JobKind
from service.procedures.analyse import add_candidate, add_result, campaign_files, store_calibration
from service.procedures.computation import Json, NumericsFailed, compute
from service.procedures.job import Job


def diagnose(job: Job) -> None:
    """Store what the model gets wrong; without an answer the campaign ends and says why."""
    try:
        answer = compute("diagnose", _files(job), {"date": utc_now()}, job.watch)
    except NumericsFailed as failed:
        with job.database.write() as session:
            job.life.finish(session, f"there is no diagnosis: {failed}")
        return
    with job.database.write() as session:
        job.queue.hold_fence(session, job.claim)
        _store(session, job, answer)
        row = session.get_one(CampaignRow, job.campaign)
        poses = FollowUpPoses(answer["next_joints"], answer["next_approach"])
        if _wants_more(session, row) and poses.joints:
            follow_ups.append_poses(session, row, poses)
            job.life.go_on(session, JobKind.collect)
        else:
            job.life.finish(session)


def repeat(job: Job) -> None:
    """Compute a result again, as a person asked."""
    request = job.request()
    result, settings = Repeatable(request["result"]), request["settings"]
    operation = "diagnose" if result is Repeatable.diagnosis else "calibrate"
    wish: Json = {"date": utc_now(), "settings": settings}
    answer = compute(operation, _files(job), wish, job.watch)
    with job.database.write() as session:
        job.queue.hold_fence(session, job.claim)
        if result is Repeatable.diagnosis:
            _store(session, job, answer)
        else:
            store_calibration(session, job, answer)
        RepeatSide(job.queue, job.claim).finish(session)


def _files(job: Job) -> dict[str, bytes]:
    with job.database.read() as session:
        return campaign_files(session, session.get_one(CampaignRow, job.campaign))


def _store(session: Session, job: Job, answer: Json) -> None:
    result = add_result(session, job, ResultKind.diagnosis, answer)
    poses = FollowUpPoses(answer["next_joints"], answer["next_approach"])
    for name, content in (answer["files"] | {NEXT_JOINTS: poses.text()}).items():
        session.add(ResultFileRow(result=result.id, name=name, content=content.encode()))
    extended = answer["extended"]
    if extended is not None:
        effects = [effect["effect"] for effect in answer["diagnosis"]["effects"]]
        of_geometry = results.newest(session, job.campaign, ResultKind.uncertainty)
        extended |= {"model": answer["model"], "uncertainty": of_geometry.document}
        result.settings = result.settings | {"effects": effects}
        add_candidate(session, result, extended)


def _wants_more(session: Session, row: CampaignRow) -> bool:
    """Whether a follow-up may ask for another round."""
    if row.kind != CampaignKind.follow_up:
        return False
    diagnoses = session.scalar(
        select(func.count())
        .select_from(ResultRow)
        .where(ResultRow.campaign == row.id, ResultRow.kind == ResultKind.diagnosis)
    )
    return (diagnoses or 0) < row.rounds

"""REST: campaigns and what came of them."""

import sys
from http import HTTPStatus
from typing import Annotated

import anyio.to_thread
from fastapi import APIRouter, Body, Depends, Header, Query, Request, Response
from fastapi.responses import StreamingResponse

from service.campaigns import events, imports, life, measurements, poses, store
from service.campaigns.models import (
    Accepted,
    Campaign,
    CampaignKind,
    Campaigns,
    CampaignState,
    Measurements,
    NewCampaign,
    Poses,
    PoseState,
    Resumption,
)
from service.campaigns.shared_looks import SharedLooks
from service.campaigns.stop_flag import StopFlag
from service.campaigns.unzip import UnpackLimits
from service.campaigns.upload import received
from service.db.models import CampaignRow
from service.dependencies import (
    DatabaseDependency,
    IdempotencyKey,
    Moment,
    OnceDependency,
    PageSize,
    QueueDependency,
    RowNumber,
    SettingsDependency,
    once_of,
)


async def _looks(request: Request) -> SharedLooks:
    looks: SharedLooks = request.app.state.looks
    return looks


LooksDependency = Annotated[SharedLooks, Depends(_looks)]

router = APIRouter(prefix="/campaigns", tags=["campaigns"])

_ZIP = {"application/zip": {"schema": {"type": "string", "format": "binary"}}}
_CSV = "text/csv"
_EVENTS = "text/event-stream"


@router.post("", status_code=HTTPStatus.ACCEPTED, response_model=Accepted)
def create_campaign(wanted: NewCampaign, once: OnceDependency, queue: QueueDependency) -> Response:
    """Queue a campaign; the cell must be armed."""
    return once.answer(lambda session: store.create(session, queue, wanted), HTTPStatus.ACCEPTED)


@router.post(
    "/import",
    status_code=HTTPStatus.ACCEPTED,
    response_model=Accepted,
    openapi_extra={"requestBody": {"required": True, "content": _ZIP}},
    # The setting upload_max_mb bounds it while it is received.
    max_body_size=sys.maxsize,
)
async def import_bundle(
    request: Request,
    database: DatabaseDependency,
    queue: QueueDependency,
    settings: SettingsDependency,
    cell: str | None = None,
    idempotency_key: IdempotencyKey = None,
) -> Response:
    """Take a bundle as .zip (as the body, or as the file of a form) and analyse it."""
    limits = UnpackLimits(
        total_bytes=int(settings.unpacked_max_mb * 1e6),
        ratio=settings.unpacked_ratio_max,
        files=settings.unpacked_files_max,
    )
    async with received(request, int(settings.upload_max_mb * 1e6)) as upload:
        once = once_of(request, database, idempotency_key, upload.sha256)

        def import_once() -> Response:
            earlier = once.earlier()
            if earlier is not None:
                return earlier
            bundle = imports.checked(upload.file, limits)
            return once.answer(
                lambda session: imports.store(session, queue, bundle, cell), HTTPStatus.ACCEPTED
            )

        return await anyio.to_thread.run_sync(import_once)


@router.get("")
def list_campaigns(
    database: DatabaseDependency,
    cell: str | None = None,
    kind: CampaignKind | None = None,
    state: CampaignState | None = None,
    since: Annotated[
        Moment | None, Query(description="made at or after this moment; UTC without a zone")
    ] = None,
    before: Annotated[RowNumber | None, Query(description="campaigns older than this one")] = None,
    limit: PageSize = 50,
) -> Campaigns:
    """Campaigns, newest first, a page at a time."""
    with database.read() as session:
        wanted = store.Filter(cell, tuple(CampaignKind) if kind is None else (kind,), state, since)
        found = store.page(session, wanted, before, limit)
    return Campaigns(campaigns=found, next_before=found[-1].id if len(found) == limit else None)


@router.get("/{campaign}")
def get_campaign(campaign: RowNumber, database: DatabaseDependency) -> Campaign:
    """State and progress of a campaign."""
    with database.read() as session:
        return store.shown(session, life.find(session, campaign))


@router.post("/{campaign}/pause", response_model=Accepted)
def pause_campaign(campaign: RowNumber, once: OnceDependency, queue: QueueDependency) -> Response:
    """Stop the robot; the campaign can be resumed."""
    return once.answer(lambda session: _accepted(life.pause(session, queue, campaign)))


@router.post("/{campaign}/resume", response_model=Accepted)
def resume_campaign(
    campaign: RowNumber,
    once: OnceDependency,
    queue: QueueDependency,
    how: Annotated[Resumption | None, Body()] = None,
) -> Response:
    """Go on at the next unmeasured pose; the cell must be armed."""
    skip_pose = how is not None and how.skip_pose
    return once.answer(
        lambda session: _accepted(life.resume(session, queue, campaign, skip_pose=skip_pose))
    )


@router.post("/{campaign}/abort", response_model=Accepted)
def abort_campaign(campaign: RowNumber, once: OnceDependency, queue: QueueDependency) -> Response:
    """Stop the robot and end the campaign; what was measured stays."""
    with StopFlag(once.database, campaign).up() as is_told:
        return once.answer(
            lambda session: _accepted(life.abort(session, queue, campaign, is_told=is_told))
        )


@router.get("/{campaign}/events", responses={200: {"content": {_EVENTS: {}}}, 204: {}})
def campaign_events(
    campaign: RowNumber,
    database: DatabaseDependency,
    looks: LooksDependency,
    settings: SettingsDependency,
    last_event_id: Annotated[RowNumber, Header()] = 0,
    since: Annotated[
        RowNumber,
        Query(
            alias="last_event_id",
            description="as the header, for a script that opens the stream anew; the later holds",
        ),
    ] = 0,
) -> Response:
    """Send readings, progress and where the arm is as server-sent events.

    `reading` and `progress` are resumed by Last-Event-ID; `arm` tells the joints of the moving
    robot a few times a second, and has no id.
    """
    # A browser that comes back by itself sends the header to the address it opened long before.
    since = max(since, last_event_id)
    seen = events.look(database, campaign, since)
    if seen.ended and seen.campaign.revision <= since:
        return Response(status_code=HTTPStatus.NO_CONTENT)
    stream = events.stream(
        looks.after,
        campaign,
        since,
        poll_s=settings.events_poll_s,
        heartbeat_s=settings.events_heartbeat_s,
    )
    return StreamingResponse(
        stream,
        media_type=_EVENTS,
        headers={"Cache-Control": "no-store", "X-Accel-Buffering": "no"},
    )


@router.get(
    "/{campaign}/measurements",
    response_model=Measurements,
    responses={200: {"content": {_CSV: {"schema": {"type": "string"}}}}},
)
def get_measurements(
    campaign: RowNumber, database: DatabaseDependency, accept: Annotated[str, Header()] = "*/*"
) -> Response:
    """Return what was measured: JSON, or measurements.csv by Accept."""
    with database.read() as session:
        row = life.find(session, campaign)
        if _CSV in accept:
            return Response(measurements.measurements_csv(session, row), media_type=_CSV)
        table = measurements.measurement_table(session, row)
    document = Measurements(campaign=campaign, columns=list(table.columns), rows=table.objects())
    return Response(document.model_dump_json(), media_type="application/json")


@router.get("/{campaign}/poses")
def get_poses(
    campaign: RowNumber, database: DatabaseDependency, state: PoseState | None = None
) -> Poses:
    """The planned poses, what became of each, and why one was skipped."""
    with database.read() as session:
        return poses.poses(session, life.find(session, campaign), state)


@router.get("/{campaign}/bundle", response_class=Response, responses={200: {"content": _ZIP}})
def get_bundle(campaign: RowNumber, database: DatabaseDependency) -> Response:
    """Return the bundle as .zip: robot.yaml, campaign.yaml, measurements.csv."""
    with database.read() as session:
        content = measurements.bundle_zip(session, life.find(session, campaign))
    return Response(
        content,
        media_type="application/zip",
        headers={"Content-Disposition": f'attachment; filename="campaign-{campaign}.zip"'},
    )


def _accepted(row: CampaignRow) -> Accepted:
    return Accepted(id=row.id, state=CampaignState(row.state))

"""A health check: its poses, its computation's request, and what its answer sets off."""

from sqlalchemy import select
from sqlalchemy.orm import Session

from robocal.health.trend import trend
from service.campaigns.results import ResultKind
from service.cells import store as cells
from service.db.models import CampaignRow, ParametersRow, PoseRow, ReadingRow, ResultRow
from service.procedures.computation import Json
from service.webhooks.models import WebhookEvent
from service.webhooks.outbox import announce


def health_request(session: Session, row: CampaignRow) -> Json:
    """Readings in SI units, the instrument, and what the calibration left unexplained."""
    parameters = session.get_one(ParametersRow, (row.cell, row.parameters_version))
    assert row.cell is not None
    tracker = cells.settings_of(cells.find(session, row.cell)).tracker
    readings = _readings(session, row.id)
    return {
        "joints": [reading.joints for reading in readings],
        "positions": [reading.position for reading in readings],
        "approach": [reading.approach for reading in readings],
        "payload_kg": row.payload_kg,
        "speed": [reading.speed for reading in readings],
        "settle_s": [reading.settle_s for reading in readings],
        "temperature_degc": _mean_temperature(readings),
        "calibrated_at_degc": _mean_temperature(_readings(session, parameters.campaign)),
        "sigma_mm": tracker.sigma_mm,
        "sigma_ppm": tracker.sigma_ppm,
        "unexplained_mm": _unexplained(parameters.document["residuals"]),
        "seed": row.seed,
    }


def store_health(session: Session, row: CampaignRow, result: ResultRow) -> None:
    """Put the check into its trend, and raise the alarm if there is one."""
    earlier = session.scalars(
        select(ResultRow)
        .join(CampaignRow, CampaignRow.id == ResultRow.campaign)
        .where(
            CampaignRow.cell == row.cell,
            CampaignRow.parameters_version == row.parameters_version,
            ResultRow.kind == ResultKind.health,
            ResultRow.id < result.id,
        )
        .order_by(ResultRow.id)
    )
    z = [check.document["z"] for check in earlier]
    point = trend([*z, result.document["z"]])
    result.document = {
        **result.document,
        "parameters_version": row.parameters_version,
        "ewma": None if point is None else point.ewma,
        "ewma_limit": None if point is None else point.limit,
        "trend_alarm": point is not None and point.alarm,
    }
    if result.document["alarm"] or result.document["trend_alarm"]:
        content = {
            "campaign": {"id": row.id, "kind": row.kind},
            "version": row.parameters_version,
            "moved": result.document["moved"],
            "advice": result.document["advice"],
        }
        announce(session, WebhookEvent.drift_alarm, row.cell, content)


def _readings(session: Session, campaign: int) -> list[ReadingRow]:
    return list(
        session.scalars(
            select(ReadingRow)
            .join(
                PoseRow, (PoseRow.campaign == ReadingRow.campaign) & (PoseRow.idx == ReadingRow.idx)
            )
            .where(ReadingRow.campaign == campaign)
            .order_by(ReadingRow.repeat, ReadingRow.idx)
        )
    )


def _mean_temperature(readings: list[ReadingRow]) -> float | None:
    known = [r.temperature_degc for r in readings if r.temperature_degc is not None]
    return sum(known) / len(known) if known else None


def _unexplained(residuals: Json) -> float:
    """RMS position error of the calibration on rows that it had not seen [mm]."""
    held_out = residuals.get("held_out") or residuals.get("fit") or {}
    return float(held_out.get("position_rms_mm") or 0.0)

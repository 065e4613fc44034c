"""A campaign as one watches it: the arm, the residuals so far, how the sensors do."""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from robocal.formats.measurements_csv import joint_columns
from robocal.formats.model_yaml import model_from_document
from robocal.identification.frames_start import nominal_flange, start_frames
from robocal.identification.observations import position_rows
from robocal.kinematics.model import KinematicModel
from robocal.robots.library import load_robot
from service.campaigns import life
from service.cells.arm_lines import arm_lines
from service.cells.bounds import surroundings
from service.cells.models import NewCell
from service.db.engine import Database
from service.db.models import CampaignRow, ParametersRow, PoseRow, ReadingRow
from service.errors import NotFound
from service.procedures.visit import spread_limit

LATEST = 300
"""Readings that the residuals are shown of."""
ENOUGH = 8
"""Fewer leave the twelve unknowns of base, tool and turn too free to show a residual."""
MOST_TIPS = 1000


class _Reading(NamedTuple):
    """What is shown of a reading; SI units."""

    idx: int
    joints: list[float]
    position: list[float]
    spread: float
    shots: int
    temperature_degc: float | None
    t_s: float


@dataclass(frozen=True)
class LiveResiduals:
    """Measured against predicted target position, base and tool fitted to these readings."""

    identified: bool
    """Against the identified geometry rather than the nominal one."""
    pose: list[int]
    mm: list[float]


@dataclass(frozen=True)
class SensorHealth:
    """What the latest reading says about the instruments."""

    spread_mm: float
    allowed_mm: float
    shots: int
    temperature_degc: float | None
    visits_again: int
    """Visits beyond the first of each reading."""
    t_s: float


@dataclass(frozen=True)
class Live:
    """After the latest reading."""

    columns: list[str]
    joints: list[float]
    arm_mm: list[list[int]]
    """The arm where it was read; the campaign's events tell where it is by now."""
    position_mm: list[float]
    residuals: LiveResiduals | None
    sensors: SensorHealth


@dataclass(frozen=True)
class PlannedTips:
    """Where the target goes, in the robot's base frame."""

    pose: list[int]
    mm: list[list[int]]


@lru_cache(maxsize=64)
def live(database: Database, number: int, created: str, revision: int) -> Live | None:
    """Look once a revision, however many pages watch; None before the first reading.

    `revision` is the campaign's own: a later one is another look. So is another `created`: after a
    restore the number may be another campaign's.
    """
    with database.read() as session:
        row, cell = _driven(session, number)
        readings = _latest(session, number)
        if not readings:
            return None
        geometry, identified = _reference(session, row, cell)
        again = _visits_again(session, number)
    robot, last = load_robot(cell.robot.model), readings[-1]
    q = np.array([reading.joints for reading in readings])
    return Live(
        columns=list(joint_columns(robot)),
        joints=np.round(q[-1] / robot.joint_scale, 3).tolist(),
        arm_mm=arm_lines(robot, surroundings(cell), q[-1:])[0],
        position_mm=[round(part * 1e3, 4) for part in last.position],
        residuals=_residuals(geometry, q, readings, identified=identified),
        sensors=SensorHealth(
            spread_mm=round(last.spread * 1e3, 4),
            allowed_mm=round(spread_limit(last.position, cell.tracker) * 1e3, 4),
            shots=last.shots,
            temperature_degc=last.temperature_degc,
            visits_again=again,
            t_s=round(last.t_s, 1),
        ),
    )


def planned_tips(session: Session, number: int) -> PlannedTips:
    """Return the plan's targets; empty while it is being computed."""
    _, cell = _driven(session, number)
    rows = session.execute(
        select(PoseRow.idx, PoseRow.commanded)
        .where(PoseRow.campaign == number)
        .order_by(PoseRow.idx)
        .limit(MOST_TIPS)
    ).all()
    if not rows:
        return PlannedTips([], [])
    q = np.array([commanded for _, commanded in rows])
    arms = arm_lines(load_robot(cell.robot.model), surroundings(cell), q)
    return PlannedTips([idx for idx, _ in rows], [arm[-1] for arm in arms])


def _driven(session: Session, number: int) -> tuple[CampaignRow, NewCell]:
    row = life.find(session, number)
    if row.cell_document is None:
        raise NotFound(f"Campaign {number} was imported; there is no robot to watch.")
    return row, NewCell.model_validate(row.cell_document)


def _latest(session: Session, number: int) -> list[_Reading]:
    query = (
        select(
            ReadingRow.idx,
            ReadingRow.joints,
            ReadingRow.position,
            ReadingRow.spread,
            ReadingRow.shots,
            ReadingRow.temperature_degc,
            ReadingRow.t_s,
        )
        .where(ReadingRow.campaign == number)
        .order_by(ReadingRow.id.desc())
        .limit(LATEST)
    )
    return [_Reading(*row) for row in session.execute(query)][::-1]


def _visits_again(session: Session, number: int) -> int:
    """Visits beyond the first of each reading; the one that is under way does not count."""
    visits = (
        select(func.max(ReadingRow.attempt).label("count"), func.count().label("readings"))
        .where(ReadingRow.campaign == number)
        .group_by(ReadingRow.idx)
        .subquery()
    )
    query = select(func.sum(visits.c.count - visits.c.readings))
    return int(session.scalar(query) or 0)


def _reference(session: Session, row: CampaignRow, cell: NewCell) -> tuple[KinematicModel, bool]:
    if row.parameters_version is None:
        return load_robot(cell.robot.model).geometry, False
    parameters = session.get_one(ParametersRow, (row.cell, row.parameters_version))
    return model_from_document(parameters.document["model"]).model, True


def _residuals(
    geometry: KinematicModel,
    q: Float[Array, "pose joint"],
    readings: list[_Reading],
    *,
    identified: bool,
) -> LiveResiduals | None:
    if len(readings) < ENOUGH:
        return None
    measured = np.array([reading.position for reading in readings])
    frames = start_frames(geometry, position_rows(q, measured, 1.0))
    found = frames.base @ nominal_flange(geometry, q) @ frames.tool
    off = np.linalg.norm(measured - found[:, :3, 3], axis=1)
    return LiveResiduals(
        identified, [reading.idx for reading in readings], np.round(off * 1e3, 4).tolist()
    )

"""Base calibrations and their touches in the database."""

import math

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from drivers.registry import ROBOTS as ROBOT_DRIVERS
from drivers.registry import STAGE_SENSORS
from robocal.base_calibration.corrections import CORRECTIONS
from service.base_calibrations.models import (
    BaseCalibrationHead,
    Cup,
    NewBaseCalibration,
    NewTouch,
    Role,
    State,
    Touch,
    TouchingRobot,
)
from service.base_calibrations.robots import StoredRobot, find_robot, sensors_of_cell
from service.clock import utc_now
from service.db.base_calibration_tables import BaseCalibrationRow, BaseTransformRow, StageTouchRow
from service.errors import Conflict, NotFound, Unusable
from service.procedures.calibrate_base import TakenTouch

LISTED = 100


def create(session: Session, wanted: NewBaseCalibration) -> BaseCalibrationRow:
    """Store a new base calibration with robots and sensors as they are now."""
    sensors = wanted.stage.sensors or sensors_of_cell(session, wanted.master.cell)
    wanted = wanted.model_copy(
        update={"stage": wanted.stage.model_copy(update={"sensors": sensors})}
    )
    for name, sensor in sensors:
        _one_of(f"stage.sensors.{name}.driver", sensor.driver, list(STAGE_SENSORS))
    for name in wanted.stage.prior_std:
        _one_of("stage.prior_std", name, [correction.field for correction in CORRECTIONS])
    row = BaseCalibrationRow(
        name=wanted.name,
        state=State.touching,
        document=wanted.model_dump(mode="json"),
        robots={
            "master": _stored(session, Role.master, wanted.master),
            "slave": _stored(session, Role.slave, wanted.slave),
        },
        created=utc_now(),
    )
    session.add(row)
    session.flush()
    return row


def _stored(session: Session, role: Role, robot: TouchingRobot) -> dict[str, object]:
    found = find_robot(session, role, robot)
    _one_of(f"{role}.robot.driver", found.driver, list(ROBOT_DRIVERS))
    return found.model_dump(mode="json")


def find(session: Session, number: int) -> BaseCalibrationRow:
    """Return the row of a base calibration; raises `NotFound`."""
    row = session.get(BaseCalibrationRow, number)
    if row is None:
        raise NotFound(f"There is no base calibration {number}.")
    return row


def newest(session: Session) -> list[BaseCalibrationHead]:
    """List the newest base calibrations."""
    rows = session.scalars(
        select(BaseCalibrationRow).order_by(BaseCalibrationRow.id.desc()).limit(LISTED)
    )
    return [_head(session, row) for row in rows]


def _head(session: Session, row: BaseCalibrationRow) -> BaseCalibrationHead:
    counted = select(func.count()).where(
        StageTouchRow.calibration == row.id, StageTouchRow.voided.is_(None)
    )
    return BaseCalibrationHead(
        id=row.id,
        name=row.name,
        state=State(row.state),
        touches=session.scalar(counted) or 0,
        version=version_made(session, row.id),
        created=row.created,
        finished=row.finished,
    )


def version_made(session: Session, number: int) -> int | None:
    """Return the version of the transform that a base calibration made."""
    return session.scalar(
        select(BaseTransformRow.version).where(BaseTransformRow.calibration == number)
    )


def settings_of(row: BaseCalibrationRow) -> NewBaseCalibration:
    """Return what was given when it was started."""
    return NewBaseCalibration.model_validate(row.document)


def robot_of(row: BaseCalibrationRow, role: Role) -> StoredRobot:
    """Return one of its robots."""
    return StoredRobot.model_validate(row.robots[role])


def open_for_touches(session: Session, number: int) -> BaseCalibrationRow:
    """Find a base calibration that still takes touches; raises `Conflict`."""
    row = find(session, number)
    if row.state != State.touching:
        raise Conflict(
            f"Base calibration {number} is finished and its touches stay as they are; start a new "
            f"one for '{row.name}'."
        )
    return row


def add_touch(session: Session, number: int, wanted: NewTouch, taken: TakenTouch) -> Touch:
    """Store a touch that was read."""
    row = open_for_touches(session, number)
    earlier = touch_rows(session, number)
    placement = max((touch.placement for touch in earlier), default=0)
    touch = StageTouchRow(
        calibration=number,
        number=len(earlier) + 1,
        robot=wanted.robot,
        cup=wanted.cup,
        placement=placement + int(wanted.stage_moved and bool(earlier)),
        joints=list(taken.joints),
        readings=list(taken.readings),
        spreads=list(taken.spreads),
        shots=taken.shots,
        created=utc_now(),
    )
    session.add(touch)
    row.revision += 1
    session.flush()
    return _shown(row, touch)


def void_touch(session: Session, number: int, touch: int, reason: str) -> Touch:
    """Let a touch count no more; it is kept with the reason."""
    row = open_for_touches(session, number)
    found = session.get(StageTouchRow, (number, touch))
    if found is None:
        raise NotFound(f"Base calibration {number} has no touch {touch}.")
    if found.voided is not None:
        raise Conflict(f"Touch {touch} of base calibration {number} is voided already.")
    found.voided, found.void_reason = utc_now(), reason
    row.revision += 1
    session.flush()
    return _shown(row, found)


def touch_rows(session: Session, number: int) -> list[StageTouchRow]:
    """All touches in their order."""
    query = select(StageTouchRow).where(StageTouchRow.calibration == number)
    return list(session.scalars(query.order_by(StageTouchRow.number)))


def touches_of(session: Session, row: BaseCalibrationRow) -> list[Touch]:
    """All touches as they go over HTTP, voided ones too."""
    return [_shown(row, touch) for touch in touch_rows(session, row.id)]


def _shown(row: BaseCalibrationRow, touch: StageTouchRow) -> Touch:
    robot = robot_of(row, Role(touch.robot))
    slide, angle, length = touch.readings
    slide_spread, angle_spread, length_spread = touch.spreads
    return Touch(
        number=touch.number,
        robot=Role(touch.robot),
        cup=Cup(touch.cup),
        placement=touch.placement,
        joints=robot.named_joints(touch.joints),
        slide_mm=slide * 1e3,
        rod_angle_deg=math.degrees(angle),
        rod_length_mm=length * 1e3,
        slide_spread_mm=slide_spread * 1e3,
        rod_angle_spread_mrad=angle_spread * 1e3,
        rod_length_spread_mm=length_spread * 1e3,
        readings=touch.shots,
        taken=touch.created,
        voided=touch.voided,
        void_reason=touch.void_reason,
    )


def _one_of(field: str, value: str, known: list[str]) -> None:
    if value not in known:
        raise Unusable(f"body {field}: '{value}' is not known; known are {', '.join(known)}.")

"""The tables of base-to-base calibrations. SI units and radians, as in `models`."""

from sqlalchemy import (
    JSON,
    CheckConstraint,
    ForeignKey,
    ForeignKeyConstraint,
    Index,
    UniqueConstraint,
    text,
)
from sqlalchemy.orm import Mapped, mapped_column

from service.db.base import Base, Document


class BaseCalibrationRow(Base):
    """One base-to-base calibration with the sensing stage, and what was asked for."""

    __tablename__ = "base_calibration"

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str]
    state: Mapped[str]
    revision: Mapped[int] = mapped_column(default=1)
    """Grows with every touch taken or voided."""
    document: Mapped[Document]
    """robots, needles, stage … as given at creation"""
    robots: Mapped[Document]
    """Of master and slave: driver, address, geometry file as it was then, joint units."""
    assessment: Mapped[Document | None] = mapped_column(JSON(none_as_null=True))
    """What the touches of `assessed` say; can be computed again."""
    assessed: Mapped[int] = mapped_column(default=0)
    """Revision of the assessment."""
    created: Mapped[str]
    finished: Mapped[str | None]

    __table_args__ = (CheckConstraint("state IN ('touching','finished')", name="state"),)


class StageTouchRow(Base):
    """One touch: a robot's joints and the stage's readings. Only its voiding is written later."""

    __tablename__ = "stage_touch"

    calibration: Mapped[int] = mapped_column(ForeignKey("base_calibration.id"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True)
    robot: Mapped[str]
    cup: Mapped[str]
    placement: Mapped[int]
    joints: Mapped[list[float]]
    readings: Mapped[list[float]]
    """Slide [m], rod angle [rad], rod length [m]."""
    spreads: Mapped[list[float]]
    """Their standard deviations over `shots` readings."""
    shots: Mapped[int]
    created: Mapped[str]
    voided: Mapped[str | None]
    void_reason: Mapped[str] = mapped_column(default="")

    __table_args__ = (
        CheckConstraint("robot IN ('master','slave')", name="robot"),
        CheckConstraint("cup IN ('rod','slide')", name="cup"),
    )


class BaseTransformRow(Base):
    """Where a slave's base stands in its master's, one version of a pair of robots."""

    __tablename__ = "base_transform"

    name: Mapped[str] = mapped_column(primary_key=True)
    version: Mapped[int] = mapped_column(primary_key=True)
    state: Mapped[str]
    calibration: Mapped[int] = mapped_column(ForeignKey("base_calibration.id"))
    document: Mapped[Document]
    bundle_sha256: Mapped[str]
    software_version: Mapped[str]
    settings: Mapped[Document]
    created: Mapped[str]
    released: Mapped[str | None]

    __table_args__ = (
        CheckConstraint("state IN ('candidate','released','superseded')", name="state"),
        UniqueConstraint("calibration"),
        Index(
            "one_released_per_pair",
            "name",
            unique=True,
            sqlite_where=text("state = 'released'"),
            postgresql_where=text("state = 'released'"),
        ),
    )


class BaseTransformEventRow(Base):
    """What happened to a version of a base transform. Never changed."""

    __tablename__ = "base_transform_event"

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str]
    version: Mapped[int]
    event: Mapped[str]
    person: Mapped[str]
    reason: Mapped[str]
    at: Mapped[str]

    __table_args__ = (
        ForeignKeyConstraint(
            ["name", "version"], ["base_transform.name", "base_transform.version"]
        ),
        Index(None, "name"),
    )

"""The tables. Their schema in the database is made by `migrations/` alone.

SI units and radians, as everywhere inside; documents that leave the service as they are
(identification.json and its like) carry their units in their names.
"""

from typing import Any, ClassVar

from sqlalchemy import (
    JSON,
    CheckConstraint,
    ForeignKey,
    ForeignKeyConstraint,
    Index,
    LargeBinary,
    MetaData,
    Text,
    UniqueConstraint,
    text,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

Document = dict[str, Any]


class Base(DeclarativeBase):
    """Names of constraints are fixed, so that migrations can address them."""

    metadata = MetaData(
        naming_convention={
            "ix": "ix_%(table_name)s_%(column_0_N_name)s",
            "uq": "uq_%(table_name)s_%(column_0_N_name)s",
            "ck": "ck_%(table_name)s_%(constraint_name)s",
            "fk": "fk_%(table_name)s_%(column_0_N_name)s",
            "pk": "pk_%(table_name)s",
        }
    )
    type_annotation_map: ClassVar[dict[Any, Any]] = {
        Document: JSON,
        list[float]: JSON,
        list[int]: JSON,
        list[str]: JSON,
        str: Text,
    }


class CellRow(Base):
    """A robot with its instruments."""

    __tablename__ = "cell"

    name: Mapped[str] = mapped_column(primary_key=True)
    document: Mapped[Document]
    """robot, tracker, limits … as given at creation"""
    armed: Mapped[bool] = mapped_column(default=False)
    created: Mapped[str]


class CampaignRow(Base):
    """One series of measurements and what was asked for."""

    __tablename__ = "campaign"

    id: Mapped[int] = mapped_column(primary_key=True)
    cell: Mapped[str | None] = mapped_column(ForeignKey("cell.name"))
    kind: Mapped[str]
    state: Mapped[str]
    wish: Mapped[str] = mapped_column(default="")
    """'pause' or 'abort' until the worker has done it"""
    reason: Mapped[str] = mapped_column(default="")
    revision: Mapped[int] = mapped_column(default=1)
    """Grows with every change: the id of server-sent events."""
    pose_count: Mapped[int]
    """Poses or, for a verification, targets; rows of an imported bundle."""
    repeats: Mapped[int]
    settle_s: Mapped[float]
    seed: Mapped[int]
    robot_yaml: Mapped[str]
    """The nominal robot as it was when the campaign was made; empty where the bundle brings it."""
    joint_units: Mapped[list[str]]
    """'deg' or 'mm' for every joint, as column names of files end."""
    parameters_version: Mapped[int | None]
    """What a verification verifies."""
    created: Mapped[str]
    started: Mapped[str | None]
    finished: Mapped[str | None]

    __table_args__ = (
        CheckConstraint(
            "state IN ('queued','running','paused','finished','aborted','failed')", name="state"
        ),
    )


class JobRow(Base):
    """Work for a worker: collect the readings of a campaign, or analyse them."""

    __tablename__ = "job"

    id: Mapped[int] = mapped_column(primary_key=True)
    campaign: Mapped[int] = mapped_column(ForeignKey("campaign.id"))
    cell: Mapped[str | None]
    kind: Mapped[str]
    state: Mapped[str]
    fence: Mapped[int] = mapped_column(default=0)
    """Grows with every claim: a worker whose number is older has lost the job."""
    lease_until: Mapped[float] = mapped_column(default=0.0)
    """Host clock, seconds since 1970."""
    worker: Mapped[str] = mapped_column(default="")
    reason: Mapped[str] = mapped_column(default="")
    created: Mapped[str]
    finished: Mapped[str | None]

    __table_args__ = (
        CheckConstraint(
            "state IN ('queued','running','held','done','failed','cancelled')", name="state"
        ),
        Index(
            "one_running_job_per_cell",
            "cell",
            unique=True,
            sqlite_where=text("state = 'running'"),
            postgresql_where=text("state = 'running'"),
        ),
        Index(None, "campaign"),
        Index(None, "state"),
    )


class PoseRow(Base):
    """One pose of a campaign's plan."""

    __tablename__ = "pose"

    campaign: Mapped[int] = mapped_column(ForeignKey("campaign.id"), primary_key=True)
    idx: Mapped[int] = mapped_column(primary_key=True)
    state: Mapped[str] = mapped_column(default="planned")
    attempt: Mapped[int] = mapped_column(default=0)
    """How often the robot was sent there, over all repeats."""
    commanded: Mapped[list[float]]
    approach: Mapped[list[int] | None] = mapped_column(JSON)
    """Direction in which each joint last moved at the latest attempt; survives a killed worker."""
    purpose: Mapped[str]

    __table_args__ = (CheckConstraint("state IN ('planned','measured','skipped')", name="state"),)


class ReadingRow(Base):
    """What was read at a pose. Written once, never changed."""

    __tablename__ = "reading"

    id: Mapped[int] = mapped_column(primary_key=True)
    campaign: Mapped[int]
    idx: Mapped[int]
    repeat: Mapped[int]
    revision: Mapped[int]
    """The campaign's revision that this reading made."""
    attempt: Mapped[int]
    fence: Mapped[int]
    joints: Mapped[list[float]]
    commanded: Mapped[list[float]]
    position: Mapped[list[float]]
    orientation: Mapped[list[float] | None] = mapped_column(JSON)
    spread: Mapped[float]
    shots: Mapped[int]
    temperature_degc: Mapped[float | None]
    approach: Mapped[list[int]]
    speed: Mapped[float]
    settle_s: Mapped[float]
    robot_time_s: Mapped[float]
    tracker_time_s: Mapped[float]
    t_s: Mapped[float]
    motion_s: Mapped[float]
    settling_s: Mapped[float]
    measuring_s: Mapped[float]
    overhead_s: Mapped[float]
    created: Mapped[str]

    __table_args__ = (
        ForeignKeyConstraint(["campaign", "idx"], ["pose.campaign", "pose.idx"]),
        UniqueConstraint("campaign", "idx", "repeat"),
    )


class BundleRow(Base):
    """An imported bundle, as a .zip of its checked files."""

    __tablename__ = "bundle"

    campaign: Mapped[int] = mapped_column(ForeignKey("campaign.id"), primary_key=True)
    content: Mapped[bytes] = mapped_column(LargeBinary)


class ResultRow(Base):
    """What was computed from a campaign, with all that is needed to compute it again."""

    __tablename__ = "result"

    id: Mapped[int] = mapped_column(primary_key=True)
    campaign: Mapped[int] = mapped_column(ForeignKey("campaign.id"))
    kind: Mapped[str]
    document: Mapped[Document]
    model_yaml: Mapped[str | None]
    bundle_sha256: Mapped[str]
    software_version: Mapped[str]
    settings: Mapped[Document]
    created: Mapped[str]

    __table_args__ = (
        CheckConstraint("kind IN ('identification','uncertainty','verification')", name="kind"),
        Index(None, "campaign", "kind"),
    )


class ParametersRow(Base):
    """Compensated parameters of a cell, one version."""

    __tablename__ = "parameters"

    cell: Mapped[str] = mapped_column(ForeignKey("cell.name"), primary_key=True)
    version: Mapped[int] = mapped_column(primary_key=True)
    state: Mapped[str]
    document: Mapped[Document]
    campaign: Mapped[int] = mapped_column(ForeignKey("campaign.id"))
    created: Mapped[str]
    released: Mapped[str | None]

    __table_args__ = (
        CheckConstraint("state IN ('candidate','released','superseded')", name="state"),
        Index(
            "one_released_per_cell",
            "cell",
            unique=True,
            sqlite_where=text("state = 'released'"),
            postgresql_where=text("state = 'released'"),
        ),
    )


class AnswerRow(Base):
    """The answer given to a POST with an Idempotency-Key."""

    __tablename__ = "answer"

    key: Mapped[str] = mapped_column(primary_key=True)
    request_sha256: Mapped[str]
    status: Mapped[int]
    body: Mapped[str]
    created: Mapped[str]

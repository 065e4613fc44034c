"""The tables. Their schema in the database is made by `migrations/` alone.

SI units and radians, as everywhere inside; documents that leave the service as they are
(identification.json and its like) carry their units in their names.
"""

from sqlalchemy import (
    JSON,
    CheckConstraint,
    ForeignKey,
    ForeignKeyConstraint,
    Index,
    LargeBinary,
    UniqueConstraint,
    text,
)
from sqlalchemy.orm import Mapped, mapped_column

# The names are given on: whoever imports this module has every table.
from service.db import access_tables as access_tables
from service.db import base_calibration_tables as base_calibration_tables
from service.db import webhook_tables as webhook_tables
from service.db.base import Base as Base
from service.db.base import Document as Document


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
    """What a verification or a health check is about."""
    follows: Mapped[int | None] = mapped_column(ForeignKey("campaign.id"))
    """The campaign whose diagnosis a follow-up is to make surer."""
    rounds: Mapped[int] = mapped_column(default=1, server_default="1")
    """How often a follow-up may ask for further poses."""
    criterion: Mapped[Document | None] = mapped_column(JSON)
    """What a verification must reach, as stated before it was driven."""
    cell_document: Mapped[Document | None] = mapped_column(JSON(none_as_null=True))
    """The cell's settings as they were when the campaign was made; empty for an import."""
    payload_kg: Mapped[float | None]
    approach_turn: Mapped[float] = mapped_column(default=0.0)
    """How far before a pose a turning joint begins its last move [rad]; 0: it comes as it may."""
    approach_slide: Mapped[float] = mapped_column(default=0.0)
    """The same of a sliding joint [m]."""
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
    """On the host's monotonic clock [s]; of the queue on one host only."""
    delivery: Mapped[int | None]
    """Procrastinate's number of the job; of the queue on several hosts only."""
    worker: Mapped[str] = mapped_column(default="")
    reason: Mapped[str] = mapped_column(default="")
    request: Mapped[Document | None] = mapped_column(JSON)
    """What a repeated computation is to compute, and with which settings."""
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


class WorkerRow(Base):
    """A worker on the one host; PostgreSQL's queue has its own."""

    __tablename__ = "worker"

    name: Mapped[str] = mapped_column(primary_key=True)
    heard: Mapped[float]
    """Latest sign of life, on the host's monotonic clock [s]."""


class ProbeRow(Base):
    """What the service writes when it is asked whether it is ready."""

    __tablename__ = "probe"

    id: Mapped[int] = mapped_column(primary_key=True)
    written: Mapped[str]


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
    sides: Mapped[list[int] | None] = mapped_column(JSON)
    """Direction in which each joint is asked to come, 0 for none; None leaves all to the seed."""
    purpose: Mapped[str]
    reason: Mapped[str] = mapped_column(default="")
    """Why it was skipped."""

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
    payload_kg: Mapped[float | None]

    __table_args__ = (
        ForeignKeyConstraint(["campaign", "idx"], ["pose.campaign", "pose.idx"]),
        UniqueConstraint("campaign", "idx", "repeat"),
    )


class ReferenceRow(Base):
    """What was read of a fixed nest, while the robot stood still. Written once, never changed."""

    __tablename__ = "reference_reading"

    id: Mapped[int] = mapped_column(primary_key=True)
    campaign: Mapped[int] = mapped_column(ForeignKey("campaign.id"))
    target: Mapped[str]
    fence: Mapped[int]
    joints: Mapped[list[float]]
    position: Mapped[list[float]]
    orientation: Mapped[list[float] | None] = mapped_column(JSON)
    spread: Mapped[float]
    shots: Mapped[int]
    temperature_degc: Mapped[float | None]
    robot_time_s: Mapped[float]
    tracker_time_s: Mapped[float]
    t_s: Mapped[float]
    after_readings: Mapped[int]
    """Readings of the robot that the campaign had by then."""
    created: Mapped[str]

    __table_args__ = (Index(None, "campaign"),)


class WhereaboutsRow(Base):
    """Where the robot was last seen on its way from pose to pose; overwritten."""

    __tablename__ = "whereabouts"

    campaign: Mapped[int] = mapped_column(ForeignKey("campaign.id"), primary_key=True)
    joints: Mapped[list[float]]


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
        CheckConstraint(
            "kind IN ('identification','uncertainty','verification','health','diagnosis')",
            name="kind",
        ),
        Index(None, "campaign", "kind"),
    )


class ResultFileRow(Base):
    """A file that belongs to a result: a report, a table of poses."""

    __tablename__ = "result_file"

    result: Mapped[int] = mapped_column(ForeignKey("result.id"), primary_key=True)
    name: Mapped[str] = mapped_column(primary_key=True)
    content: Mapped[bytes] = mapped_column(LargeBinary)


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
        CheckConstraint("state IN ('candidate','verified','released','superseded')", name="state"),
        Index(
            "one_released_per_cell",
            "cell",
            unique=True,
            sqlite_where=text("state = 'released'"),
            postgresql_where=text("state = 'released'"),
        ),
    )


class ParametersEventRow(Base):
    """One step in the life of a version: what, who, when, from which readings. Never changed."""

    __tablename__ = "parameters_event"

    id: Mapped[int] = mapped_column(primary_key=True)
    cell: Mapped[str]
    version: Mapped[int]
    event: Mapped[str]
    person: Mapped[str | None]
    """None where a campaign did it by itself."""
    reason: Mapped[str] = mapped_column(default="")
    campaign: Mapped[int | None] = mapped_column(ForeignKey("campaign.id"))
    origin: Mapped[Document]
    """Hash of the readings, software version, settings and seed behind this step."""
    at: Mapped[str]

    __table_args__ = (
        ForeignKeyConstraint(["cell", "version"], ["parameters.cell", "parameters.version"]),
        Index(None, "cell"),
    )


class AnswerRow(Base):
    """The answer given to a POST with an Idempotency-Key."""

    __tablename__ = "answer"

    key: Mapped[str] = mapped_column(primary_key=True)
    request_sha256: Mapped[str]
    status: Mapped[int]
    body: Mapped[str]
    created: Mapped[str]

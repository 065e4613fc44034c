"""Wanted poses in, joints out."""

from enum import StrEnum
from typing import Annotated

from pydantic import BaseModel, Field

from robocal.orientation_of import OrientationOf
from robocal.reach import Reach
from service.campaigns.models import JointColumns
from service.cells.models import Strict

MOST_TARGETS = 10_000

Number = Annotated[float, Field(ge=-1e6, le=1e6)]


class Frame(StrEnum):
    """In which frame the wanted poses stand."""

    cell = "cell"
    base = "base"


class WantedPose(Strict):
    """Where the tool's target shall be."""

    xyz_mm: tuple[Number, Number, Number]
    quaternion: tuple[Number, Number, Number, Number]
    """w, x, y, z."""
    nominal_joints: JointColumns | None = None
    """The nominal robot's joints there, which decide elbow and wrist: `{"j1_deg": 10, ...}`."""


class CompensationRequest(Strict):
    """Poses to be reached."""

    poses: Annotated[list[WantedPose], Field(min_length=1, max_length=MOST_TARGETS)]
    frame: Frame = Frame.cell
    """`cell`: as the tracker sees it; `base`: in the robot's calibrated base."""
    orientation_of: OrientationOf | None = None
    """Whose orientation the quaternions state: `tool` or `flange`. Without it the tool's, but the
    flange's with parameters from positions alone, which know no other."""
    temperature_degc: Annotated[float, Field(ge=-100, le=300)] | None = None
    """Of the robot now, for a model that knows of temperature."""
    payload_kg: Annotated[float, Field(ge=0, le=10_000)] | None = None


class MissedPose(BaseModel):
    """A wanted pose that gets no joints, and why."""

    pose: int
    """Place in the request, from 0."""
    status: Reach
    detail: str


class CompensatedJoints(BaseModel):
    """Joints for every wanted pose, in the request's order."""

    cell: str
    version: int
    """Of the parameters that were used."""
    orientation_of: OrientationOf
    """Whose orientation the poses' quaternions were taken for."""
    columns: list[str]
    """What stands in a row: `j1_deg`, ..., `j3_mm` for a prismatic joint."""
    joints_deg: list[list[float] | None] | None
    """One row a pose, null where it cannot be reached; null for a robot with prismatic joints."""
    joints: list[list[float] | None] | None
    """The same in the columns' units, for a robot with prismatic joints alone."""
    reached: int
    missed: list[MissedPose]

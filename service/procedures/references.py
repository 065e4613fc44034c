"""Fixed nests, measured again and again between the poses: their rows show the station's drift."""

from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from drivers.interfaces import FixedNest, TurningTracker
from service.cells.models import NestSettings, References
from service.db.models import ReferenceRow
from service.procedures.acceptance import (
    accept_reference,
    count_readings,
    elapsed,
    tracker_columns,
)
from service.procedures.devices import Devices
from service.procedures.job import Job


@dataclass(frozen=True)
class FixedNests:
    """The nests of a campaign's cell."""

    settings: References

    def due(self, session: Session, campaign: int, robot_time_s: float, *, at_end: bool) -> bool:
        """Whether the nests are to be measured now.

        After the first reading, which sets the clock of the rows; at the end; and in between as
        often as the cell wants it.
        """
        readings = count_readings(session, campaign)
        latest = session.scalars(
            select(ReferenceRow)
            .where(ReferenceRow.campaign == campaign)
            .order_by(ReferenceRow.id.desc())
            .limit(1)
        ).first()
        if latest is None:
            return readings > 0
        since = readings - latest.after_readings
        if since == 0:
            return False
        passed_s = elapsed(session, campaign, robot_time_s) - latest.t_s
        return at_end or since >= self.settings.every_poses or passed_s >= self.settings.every_s

    def measure(self, job: Job, devices: Devices) -> None:
        """Measure every nest once, while the robot stands; one transaction for the whole visit."""
        assert isinstance(devices.tracker, TurningTracker)
        rows = []
        for nest in self.settings.nests:
            job.watch.check()
            reading = devices.tracker.measure_fixed(_nest(nest))
            state = devices.robot.state()
            rows.append(
                ReferenceRow(
                    target=nest.name,
                    joints=list(state.joints),
                    **tracker_columns(reading),
                    temperature_degc=devices.temperature_degc(),
                    robot_time_s=state.time_s,
                )
            )
        with job.database.write() as session:
            for row in rows:
                accept_reference(session, job, row)


def _nest(settings: NestSettings) -> FixedNest:
    x, y, z = settings.xyz_mm
    return FixedNest(settings.name, (x * 1e-3, y * 1e-3, z * 1e-3))

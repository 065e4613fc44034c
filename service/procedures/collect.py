"""Collect the readings of a campaign, pose by pose; each is accepted in one transaction.

No engine makes a motion exactly once: the pose that was under way when a worker died is driven
again, with the next attempt number, but it is accepted once.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import select

from drivers.errors import DriverError
from drivers.interfaces import MAY_MOVE, RobotState
from robocal.robots.library import load_robot
from service.campaigns import life
from service.campaigns.models import CampaignKind
from service.cells.bounds import narrowed, surroundings
from service.cells.models import NewCell
from service.db.models import CampaignRow, CellRow, PoseRow
from service.procedures.acceptance import (
    Accepted,
    accept,
    begin,
    require_leave,
    skip,
    visits_ahead,
)
from service.procedures.devices import Devices, connected
from service.procedures.job import Held, Job
from service.procedures.plan import ensure_plan
from service.procedures.references import FixedNests
from service.procedures.sides import Sides, approach_offset, as_asked, balanced_sides
from service.procedures.visit import (
    ARRIVED_WITHIN,
    Pace,
    PoseNotTrue,
    Sight,
    Visitor,
    pace_of,
    settle,
    visit,
)
from service.procedures.ways import Judge, NextVisit, Route
from service.procedures.whereabouts import Whereabouts

VISITS = 2
"""How often a pose is driven to before it is skipped; each time all is judged anew."""


@dataclass(frozen=True)
class Setup:
    """What does not change during a campaign."""

    cell: NewCell
    pace: Pace
    judge: Judge
    stances: tuple[tuple[float, ...], ...]
    """The campaign's own poses: stops where the straight way is not free."""


def collect(job: Job) -> None:
    """Drive the campaign to its end; raises `Held` when a device needs a person."""
    _require_arming(job)
    ensure_plan(job)
    setup = _setup(job)
    try:
        with (
            Whereabouts(job) as whereabouts,
            connected(setup.cell, setup.judge.robot.n_joints) as devices,
        ):
            # A motion that a dead worker had started may still be under way.
            devices.robot.stop()
            settle(devices.robot, 0.0, job.watch)
            with whereabouts.to_rest(devices.robot):
                Course(job, setup, devices, whereabouts).run()
    except DriverError as error:
        job.watch.check()
        raise Held(str(error)) from error
    except PoseNotTrue as error:
        raise Held(f"Before the first motion {error}, then resume.") from error
    # Only now that the devices are let go: the cell's next job may start at once on another host,
    # and a late stop or goodbye of this one would meet it in the middle of a motion. After a crash
    # in between, whoever takes the job finds no pose left and comes here.
    with job.database.write() as session:
        job.life.finish_collecting(session)


def _require_arming(job: Job) -> None:
    with job.database.read() as session:
        row = session.get_one(CampaignRow, job.campaign)
        cell = session.get_one(CellRow, row.cell)
        if not cell.armed:
            raise Held(life.not_armed(cell.name))


def _setup(job: Job) -> Setup:
    with job.database.read() as session:
        row = session.get_one(CampaignRow, job.campaign)
        cell = NewCell.model_validate(row.cell_document)
        poses = session.scalars(
            select(PoseRow).where(PoseRow.campaign == row.id).order_by(PoseRow.idx)
        ).all()
        robot = narrowed(load_robot(cell.robot.model), cell.limits)
        verifies = row.kind == CampaignKind.verify
        balanced = balanced_sides(len(poses), robot.n_joints, row.seed)
        sides = Sides(
            signs=as_asked(balanced, [pose.sides for pose in poses]),
            offset=approach_offset(robot, row.approach_turn, row.approach_slide),
            limits=robot.limits,
            poses_alike=2 if verifies else 1,
            change_with_repeats=row.kind == CampaignKind.calibrate,
        )
        return Setup(
            cell,
            pace_of(cell.limits, row.settle_s),
            Judge(robot, surroundings(cell), sides),
            tuple(tuple(pose.commanded) for pose in poses if pose.state != "skipped"),
        )


class Course:
    """From pose to pose until none is left."""

    def __init__(self, job: Job, setup: Setup, devices: Devices, whereabouts: Whereabouts) -> None:
        self._job = job
        self._setup = setup
        self._devices = devices
        self._visitor = Visitor(
            devices.robot,
            devices.tracker,
            setup.cell.tracker,
            setup.pace,
            job.watch,
            whereabouts.saw,
        )
        references = setup.cell.references
        self._nests = None if references is None else FixedNests(references)
        self._prepared: tuple[NextVisit, Route] | None = None
        self._since = time.perf_counter()

    def run(self) -> None:
        """Measure everything."""
        while self._step():
            pass

    def _step(self) -> bool:
        """Do the next thing; False when there was none left."""
        self._job.watch.check()
        state = self._state()
        with self._job.database.read() as session:
            ahead = visits_ahead(session, self._job.campaign, 2)
            nests_due = self._nests is not None and self._nests.due(
                session, self._job.campaign, state.time_s, at_end=not ahead
            )
        if self._nests is not None and nests_due:
            self._nests.measure(self._job, self._devices)
            self._since = time.perf_counter()
            return True
        return bool(ahead) and self._measure(ahead[0], ahead[1:], state)

    def _measure(self, coming: NextVisit, after: Sequence[NextVisit], state: RobotState) -> bool:
        """Visit one pose until its reading is true, or skip it; False after the very last."""
        reason = ""
        for _ in range(VISITS):
            route = self._route(coming, state.joints)
            if not route.stops:
                reason = route.refusal
                break
            try:
                return self._visit(coming, after, route)
            except PoseNotTrue as not_true:
                reason = f"{not_true} (seen on {VISITS} visits)"
                state = self._state()
        with self._job.database.write() as session:
            skip(session, self._job, coming, reason)
        self._since = time.perf_counter()
        return True

    def _visit(self, coming: NextVisit, after: Sequence[NextVisit], route: Route) -> bool:
        job = self._job
        with job.database.write() as session:
            attempt = begin(session, job, coming, route)
        sight = visit(
            self._visitor, route.start, route.stops, self._permit, lambda: self._prepare(after)
        )
        temperature_degc = self._devices.temperature_degc()
        with job.database.write() as session:
            accepted_at = time.perf_counter()
            overhead_s = accepted_at - self._since - _spent(sight)
            accepted = Accepted(coming, attempt, sight, temperature_degc, overhead_s)
            accept(session, job, accepted, self._setup.pace)
            more = self._nests is not None or bool(visits_ahead(session, job.campaign, 1))
        self._since = accepted_at
        return more

    def _permit(self) -> RobotState:
        """Where the robot stands; raises unless this worker may move it now."""
        self._job.watch.check()
        with self._job.database.read() as session:
            require_leave(session, self._job)
        return self._state()

    def _state(self) -> RobotState:
        """Where the robot stands; raises `Held` when its controller forbids motion."""
        state = self._devices.robot.state()
        if state.safety not in MAY_MOVE:
            raise Held(f"The robot may not move, it is in {state.safety}: {state.advice}")
        return state

    def _route(self, coming: NextVisit, joints: tuple[float, ...]) -> Route:
        """The way from here, if it was not found while the robot settled."""
        if self._prepared is not None and self._prepared[0] == coming:
            route = self._prepared[1]
            off = max(abs(a - b) for a, b in zip(route.start, joints, strict=True))
            self._prepared = None
            if off <= ARRIVED_WITHIN:
                return route
        return self._setup.judge.route(joints, coming, self._setup.stances)

    def _prepare(self, after: Sequence[NextVisit]) -> None:
        """Find the next way while the robot settles, which costs no time."""
        self._prepared = None
        if after:
            here = self._devices.robot.state().joints
            route = self._setup.judge.route(here, after[0], self._setup.stances)
            self._prepared = (after[0], route)


def _spent(sight: Sight) -> float:
    return math.fsum((sight.seconds.motion, sight.seconds.settling, sight.seconds.measuring))

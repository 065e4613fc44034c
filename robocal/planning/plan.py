"""From a robot in its cell to the list of visits: candidates, number, choice, factors, order."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.errors import BadInput, NoAnswer
from robocal.planning.candidates import UNBOUND, draw_candidates
from robocal.planning.cell import Cell
from robocal.planning.chosen_set import Selection
from robocal.planning.curve import IndexCurve, index_curve
from robocal.planning.number import poses_until
from robocal.planning.observability import INDICES, observability
from robocal.planning.pose_rows import PoseRows, pose_rows
from robocal.planning.prediction import predicted_radius
from robocal.planning.request import PlanRequest
from robocal.planning.selectors import MERITS, SELECTORS, WORKSPACE, merit
from robocal.planning.visits import Visits, arrange_visits
from robocal.robots.robot import Robot

TEST_POSES = 200
_SERVICE_CANDIDATES = 400


@dataclass(frozen=True)
class Plan:
    """The visits, and what they promise."""

    request: PlanRequest
    rows: PoseRows
    candidates: Float[Array, "candidate joint"]
    chosen: Int[Array, "chosen"]
    visits: Visits
    curve: IndexCurve
    indices: dict[str, float]
    """Of the chosen poses, each counted once."""
    radius: Float[Array, "test"]
    """Predicted radius at the test poses, from the chosen poses, each counted once [m]."""


def make_plan(request: PlanRequest) -> Plan:
    """A plan.

    Raises
    ------
    BadInput
        If the request names what is not known, or wants more poses than candidates.
    NoAnswer
        If the cell leaves no poses, the poses are too few for the parameters, the index does not
        settle, or the uncertainty cannot be reached.
    """
    _refuse_unknown(request)
    rng = np.random.default_rng(request.seed)
    q = draw_candidates(request.robot, request.candidates, rng, request.cell)
    rows = pose_rows(request.robot, request.cell, q)
    test_rows = rows.position_rows(_test_poses(request))
    curve = index_curve(rows.J, request.seed)
    make_set = merit(request.merit, test_rows)
    select = SELECTORS[request.selector]
    if request.uncertainty is not None:
        chosen = poses_until(rows, test_rows, request.uncertainty, make_set, select, request.seed)
    else:
        count = _settled(request, curve) if request.count is None else request.count
        _refuse_count(count, rows)
        chosen = select(Selection(rows.J, count, make_set, request.seed))
    return Plan(
        request=request,
        rows=rows,
        candidates=q,
        chosen=chosen,
        visits=arrange_visits(request, rows, q, chosen),
        curve=curve,
        indices=observability(rows.J[chosen]),
        radius=predicted_radius(rows.J, chosen, test_rows),
    )


def plan_poses(
    robot: Robot, count: int, seed: int, cell: Cell = UNBOUND
) -> Float[Array, "pose joint"]:
    """Joint readings to measure, in order of travel: DETMAX for O1, positions seen.

    Fewer poses than the parameters need are allowed here: they are the most informative ones.

    Parameters
    ----------
    robot
        Nominal robot.
    count
        Number of poses.
    seed
        Of candidates and search; the same seed gives the same poses.
    cell
        What bounds the poses.

    Raises
    ------
    NoAnswer
        If hardly any pose is admissible.
    """
    candidates = max(_SERVICE_CANDIDATES, 4 * count)
    request = PlanRequest(robot, cell, "O1", "detmax", candidates, seed, count)
    try:
        q = draw_candidates(robot, candidates, np.random.default_rng(seed), request.cell)
    except NoAnswer as few:
        raise NoAnswer(f"no plan of {count} poses: {few}") from few
    rows = pose_rows(robot, request.cell, q)
    make_set = merit(request.merit, np.empty((0, 3, len(rows.scale))))
    chosen = SELECTORS[request.selector](Selection(rows.J, count, make_set, seed))
    return arrange_visits(request, rows, q, chosen).q


def _test_poses(request: PlanRequest) -> Float[Array, "test joint"]:
    """Poses of the workspace, other than the candidates."""
    rng = np.random.default_rng([request.seed, TEST_POSES])
    return draw_candidates(request.robot, TEST_POSES, rng, request.cell.for_test_poses())


def _settled(request: PlanRequest, curve: IndexCurve) -> int:
    index = "O1" if request.merit == WORKSPACE else request.merit
    count = curve.settled_count(index)
    if count is None:
        raise NoAnswer(
            f"{index} has not settled at {curve.counts[-1]} random poses, so it gives no number "
            "(O3, O4 and O5 never settle); give the number, or an uncertainty to reach"
        )
    return count


def _refuse_unknown(request: PlanRequest) -> None:
    for what, name, known in (
        ("index", request.merit, MERITS),
        ("selector", request.selector, tuple(SELECTORS)),
    ):
        if name not in known:
            raise BadInput(f"{what} '{name}'", f"is not known; known are {', '.join(known)}")
    if request.selector == "relaxed" and request.merit != next(iter(INDICES)):
        raise BadInput("selector 'relaxed'", "knows O1 only; take detmax or exchange")


def _refuse_count(count: int, rows: PoseRows) -> None:
    if count >= len(rows.J):
        raise BadInput(f"count {count}", f"is not less than the {len(rows.J)} candidates")
    if count < rows.fewest:
        raise NoAnswer(
            f"{count} poses give {count * rows.J.shape[1]} numbers for {rows.J.shape[2]} "
            f"parameters; plan at least {rows.fewest}"
        )

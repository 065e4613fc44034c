"""What a plan is asked for."""

from dataclasses import dataclass, field

from robocal.planning.cell import Cell
from robocal.planning.order import JointSpeed
from robocal.robots.robot import Robot


@dataclass(frozen=True)
class PlanRequest:
    """What a plan is asked for.

    Parameters
    ----------
    robot, cell
        Nominal robot, and what bounds and sees its poses.
    merit, selector
        One of `selectors.MERITS`, one of `selectors.SELECTORS`.
    candidates
        Random poses to choose from.
    seed
        Of candidates, test poses and search.
    count
        Number of different poses; None: from the index curve, or from `uncertainty`.
    uncertainty
        Largest predicted radius (`prediction.COVERAGE`) anywhere in the workspace [m].
    further_visits
        Visits of poses already visited, for the pure error.
    with_approach
        Whether the direction of approach is stated for every pose.
    speed
        Of the joints, for the order of visits.
    """

    robot: Robot
    cell: Cell
    merit: str
    selector: str
    candidates: int
    seed: int
    count: int | None = None
    uncertainty: float | None = None
    further_visits: int = 0
    with_approach: bool = False
    speed: JointSpeed = field(default_factory=JointSpeed)

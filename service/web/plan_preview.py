"""The plan of a campaign before it is started: the same computation, poses and order."""

import json
from dataclasses import dataclass

import numpy as np

from robocal.formats.measurements_csv import joint_columns
from robocal.robots.library import load_robot, robot_path
from service.cells.arm_lines import FRAMES_A_MOVE, Polylines, arm_lines, on_the_way
from service.cells.bounds import surroundings
from service.cells.models import NewCell
from service.errors import Unusable
from service.procedures.computation import NumericsFailed, compute
from service.procedures.patience import patience
from service.procedures.plan import CELL

MOST_POSES = 200
"""More are not drawn: nobody looks at them one by one."""


@dataclass(frozen=True)
class PlanPreview:
    """Poses in the order in which they would be driven."""

    seed: int
    columns: list[str]
    joints: list[list[float]]
    """Under these columns of measurements.csv [deg, mm]."""
    frames_a_move: int
    arms_mm: Polylines
    """The arm at every pose, and `frames_a_move` - 1 times between it and the next."""


def preview(cell: NewCell, count: int, seed: int) -> PlanPreview:
    """Plan a calibration; raises `Unusable` with the planner's own sentence."""
    if count > MOST_POSES:
        raise Unusable(f"query poses: {count} are too many to be drawn; at most {MOST_POSES} are.")
    model = cell.robot.model
    files = {
        "robot.yaml": robot_path(model).read_bytes(),
        CELL: json.dumps(cell.model_dump(mode="json")).encode(),
    }
    try:
        planned = compute("plan", files, {"count": count, "seed": seed}, patience())
    except NumericsFailed as error:
        raise Unusable(str(error)) from error
    robot, q = load_robot(model), np.array(planned["joints"])
    return PlanPreview(
        seed=seed,
        columns=list(joint_columns(robot)),
        joints=np.round(q / robot.joint_scale, 2).tolist(),
        frames_a_move=FRAMES_A_MOVE,
        arms_mm=arm_lines(robot, surroundings(cell), on_the_way(q)),
    )

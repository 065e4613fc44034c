"""The arm where it was last seen, as a server-sent event: while it moves, a few times a second."""

import json
from functools import lru_cache

import numpy as np
from sqlalchemy.orm import Session

from robocal.formats.measurements_csv import joint_columns
from robocal.planning.cell import Cell
from robocal.robots.library import load_robot
from robocal.robots.robot import Robot
from service.cells.arm_lines import arm_lines
from service.cells.bounds import surroundings
from service.cells.models import NewCell
from service.db.models import CampaignRow, WhereaboutsRow


def arm_now(session: Session, row: CampaignRow) -> str | None:
    """Return what a page is told of the arm; None where it was not seen yet."""
    seen = session.get(WhereaboutsRow, row.id)
    return None if seen is None else _payload(json.dumps(row.cell_document), tuple(seen.joints))


@lru_cache(maxsize=64)
def _payload(cell_document: str, joints: tuple[float, ...]) -> str:
    robot, cell = _driven(cell_document)
    q = np.array([joints])
    return json.dumps({
        "columns": list(joint_columns(robot)),
        "joints": np.round(q[0] / robot.joint_scale, 3).tolist(),
        "arm_mm": arm_lines(robot, cell, q)[0],
    })


@lru_cache(maxsize=64)
def _driven(cell_document: str) -> tuple[Robot, Cell]:
    """Return the robot and what is around it.

    Kept by what describes them: after a restore a campaign's number may be another campaign's.
    """
    cell = NewCell.model_validate_json(cell_document)
    return load_robot(cell.robot.model), surroundings(cell)

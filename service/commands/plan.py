"""`robocal plan`."""

import json
from pathlib import Path
from typing import Annotated

import typer

from service.commands.options import AsJson, OutFolder, make_folder, write_json


def plan(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="robot.yaml or a known name")],
    out: OutFolder,
    count: Annotated[int, typer.Option(min=1, max=2000)] = 40,
    seed: Annotated[int, typer.Option(min=0)] = 1,
    *,
    as_json: AsJson = False,
) -> None:
    """Poses worth measuring: writes plan.csv and plan.json."""
    from robocal.formats.poses_csv import write_plan
    from robocal.formats.robot_yaml import read_robot
    from robocal.planning.exchange import plan_poses
    from robocal.robots.library import ROBOTS, load_robot

    arm = load_robot(robot) if robot in ROBOTS else read_robot(Path(robot))
    q = plan_poses(arm, count, seed)
    make_folder(out)
    write_plan(out / "plan.csv", arm, q)
    document = {"robot": arm.name, "count": count, "seed": seed, "index": "D-optimal"}
    write_json(out / "plan.json", document)
    print(json.dumps(document) if as_json else f"{len(q)} poses -> {out / 'plan.csv'}")

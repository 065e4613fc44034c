"""`robocal plan`."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from robocal.errors import BadInput
from service.commands.options import AsJson, OutFolder, json_text, make_folder, robot_names
from service.progress_bar import progress_bar

if TYPE_CHECKING:
    from robocal.planning.plan import Plan

RobotFile = Annotated[
    str,
    typer.Argument(metavar="ROBOT", help="robot.yaml or a known name", autocompletion=robot_names),
]
Index = Annotated[str, typer.Option(help="O1 to O5, or workspace: least predicted uncertainty")]
SelectorName = Annotated[str, typer.Option(help="detmax, exchange, relaxed or random")]
Count = Annotated[str, typer.Option(help="number of poses, or auto: where the index settles")]
Until = Annotated[float | None, typer.Option(help="as many poses as bring U95 below this")]
CellFile = Annotated[Path | None, typer.Option(help="YAML: floor, box, tracker, workspace ...")]
Candidates = Annotated[int, typer.Option(help="random poses to choose from", min=20, max=20000)]
Repeats = Annotated[int, typer.Option(help="further visits, for the pure error", min=0, max=2000)]
Approach = Annotated[bool, typer.Option("--approach", help="state the directions of approach")]
Seed = Annotated[int, typer.Option(min=0)]


def plan(
    robot: RobotFile,
    out: OutFolder,
    index: Index = "O1",
    selector: SelectorName = "detmax",
    count: Count = "auto",
    until_mm: Until = None,
    cell: CellFile = None,
    candidates: Candidates = 1000,
    repeats: Repeats = 0,
    seed: Seed = 1,
    *,
    approach: Approach = False,
    as_json: AsJson = False,
) -> None:
    """Poses worth measuring: writes plan.csv, plan.json and plan.svg."""
    from robocal.formats.robot_yaml import read_robot
    from robocal.planning.cell import Cell
    from robocal.planning.cell_yaml import read_cell
    from robocal.planning.plan import make_plan
    from robocal.planning.request import PlanRequest
    from robocal.robots.library import ROBOTS, load_robot

    if until_mm is not None and count != "auto":
        raise BadInput(
            "--count and --until-mm",
            "both ask for a number of poses; give --count alone, or --until-mm alone",
        )
    request = PlanRequest(
        load_robot(robot) if robot in ROBOTS else read_robot(Path(robot)),
        Cell() if cell is None else read_cell(cell),
        index,
        selector,
        candidates,
        seed,
        _number_of_poses(count),
        None if until_mm is None else _radius(until_mm),
        repeats,
        approach,
    )
    with progress_bar(as_json=as_json):
        planned = make_plan(request)
    _write(planned, out, as_json=as_json)


def _write(planned: "Plan", out: Path, *, as_json: bool) -> None:
    """Write the three files and say what they hold."""
    from robocal.formats.whole_file import write_together
    from robocal.planning.picture import plan_picture
    from robocal.planning.plan_document import plan_csv, plan_document, plan_lines

    document = plan_document(planned)
    make_folder(out)
    write_together({
        out / "plan.csv": plan_csv(planned),
        out / "plan.svg": plan_picture(planned),
        out / "plan.json": json_text(document),
    })
    print(json.dumps(document) if as_json else "\n".join(plan_lines(planned, out)))


def _number_of_poses(count: str) -> int | None:
    """None for auto.

    Raises
    ------
    BadInput
        If it is neither a positive whole number nor auto.
    """
    if count == "auto":
        return None
    if not count.isdecimal() or int(count) == 0:
        raise BadInput("--count", f"must be a positive whole number or auto, not '{count}'")
    return int(count)


def _radius(until_mm: float) -> float:
    """In metres.

    Raises
    ------
    BadInput
        If it is no positive number.
    """
    if not 0 < until_mm < float("inf"):
        raise BadInput("--until-mm", f"must be a positive number, not {until_mm:g}")
    return until_mm * 1e-3

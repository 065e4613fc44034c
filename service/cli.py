"""The command line. Exit status 0 done, 2 bad input (one line), 3 the numbers allow no answer."""

import json
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from robocal.errors import BadInput, NoAnswer

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Robot-cell calibration: identify what the robot really is, and say how sure it is.",
)

BundleFolder = Annotated[Path, typer.Argument(help="folder with campaign.yaml", metavar="BUNDLE")]
OutFolder = Annotated[Path, typer.Option("--out", help="folder for the results, made if missing")]
OutFile = Annotated[Path, typer.Option("--out", help="CSV file to write")]
AsJson = Annotated[bool, typer.Option("--json", help="print the result's JSON and nothing else")]


def main() -> None:
    """Run a command; turn errors on purpose into one line and an exit status."""
    try:
        app()
    except BadInput as error:
        _leave(f"robocal: {error}", 2)
    except NoAnswer as error:
        _leave(f"robocal: {error}", 3)
    except BrokenPipeError:
        sys.stderr.close()


def _leave(sentence: str, status: int) -> None:
    sys.stderr.write(sentence.replace("\n", " ") + "\n")
    sys.exit(status)


@app.command()
def identify(
    bundle: BundleFolder,
    out: OutFolder,
    strategy: Annotated[str, typer.Option(help="cross or simultaneous")] = "simultaneous",
    *,
    as_json: AsJson = False,
) -> None:
    """Identify geometry, base and tool: writes identification.json and model.yaml."""
    from robocal.formats.identification_json import identification_document
    from robocal.formats.model_yaml import write_model
    from service.calibration import calibrate
    from service.report_lines import identification_lines

    measured, result, calibrated = calibrate(bundle, strategy, datetime.now(UTC))
    document = identification_document(result)
    _make(out)
    _write_json(out / "identification.json", document)
    write_model(out / "model.yaml", calibrated)
    if as_json:
        print(json.dumps(document, indent=2))
    else:
        print("\n".join(identification_lines(measured, result, out)))


@app.command()
def predict(
    model: Annotated[Path, typer.Argument(metavar="MODEL.yaml")],
    poses: Annotated[Path, typer.Argument(metavar="POSES.csv")],
    out: OutFile,
    *,
    as_json: AsJson = False,
) -> None:
    """Tool poses of the calibrated robot at given joints."""
    from robocal.formats.model_yaml import read_model
    from robocal.formats.poses_csv import predict_table

    rows = predict_table(read_model(model), poses, out)
    print(json.dumps({"rows": rows, "out": str(out)}) if as_json else f"{rows} poses -> {out}")


@app.command()
def uncertainty(
    bundle: BundleFolder,
    out: OutFolder,
    draws: Annotated[int, typer.Option(min=1000, max=1_000_000)] = 10_000,
    seed: Annotated[int, typer.Option(min=0)] = 1,
    *,
    as_json: AsJson = False,
) -> None:
    """Uncertainty of the tool at the measured poses: writes uncertainty.json."""
    from robocal.uncertainty.first_evaluation import evaluate_first, uncertainty_document
    from service.calibration import calibrate

    measured, result, calibrated = calibrate(bundle, "simultaneous", datetime.now(UTC))
    rows = measured.measurements
    evaluation = evaluate_first(calibrated, rows.joints, draws, seed)
    document = uncertainty_document(evaluation, rows.lines, result.chi_square, result.nu)
    _make(out)
    _write_json(out / "uncertainty.json", document)
    if as_json:
        print(json.dumps(document, indent=2))
    else:
        tool = evaluation.draws
        print(
            f"tool position, {len(rows)} poses: U95 mean {tool.radius.mean() * 1e3:.4f} mm, "
            f"max {tool.radius.max() * 1e3:.4f} mm -> {out / 'uncertainty.json'}"
        )


@app.command()
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
    _make(out)
    write_plan(out / "plan.csv", arm, q)
    document = {"robot": arm.name, "count": count, "seed": seed, "index": "D-optimal"}
    _write_json(out / "plan.json", document)
    print(json.dumps(document) if as_json else f"{len(q)} poses -> {out / 'plan.csv'}")


@app.command()
def serve(
    host: Annotated[str | None, typer.Option(help="address to listen on")] = None,
    port: Annotated[int | None, typer.Option(min=1, max=65535)] = None,
    *,
    worker: Annotated[bool, typer.Option(help="also run a worker beside the service")] = True,
) -> None:
    """Run the service (REST and web page) and its worker."""
    from service.serve import serve as run

    run(host, port, with_worker=worker)


@app.command()
def demo(
    *,
    once: Annotated[bool, typer.Option(envvar="ONCE", help="stop when done")] = False,
) -> None:
    """Run the whole chain against emulated hardware: campaign, identification, verification."""
    from service.demo import run_demo

    run_demo(once=once)


@app.command()
def emulate(
    robot: Annotated[str, typer.Option(help="a known robot")] = "ur10e",
    time_scale: Annotated[float, typer.Option(min=1.0, max=1000.0)] = 1.0,
) -> None:
    """Start an emulated cell (robot controller, tracker) for a person to try."""
    from service.emulated_cell import emulate as run

    run(robot, time_scale)


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(str(folder), f"cannot be made: {error.strerror}") from None


def _write_json(path: Path, document: dict[str, object]) -> None:
    path.write_text(json.dumps(document, indent=2, allow_nan=False) + "\n", encoding="utf-8")

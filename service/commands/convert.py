"""`robocal convert`: files of other programs into robot.yaml or a bundle."""

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from robocal.errors import BadInput
from service.commands.options import AsJson, OutFolder, make_folder

if TYPE_CHECKING:
    from robocal.formats.measured_table import DeclaredNoise, MeasurementOptions
    from robocal.formats.robot_import import RobotOptions
    from robocal.robots.robot import Robot


def convert(
    file: Annotated[Path, typer.Argument(metavar="FILE")],
    file_format: Annotated[
        str,
        typer.Option(
            "--format",
            help="a robot: urdf, ur-kinematics, ur-calibration; "
            "measurements: spatial-analyzer, robodk, figaroh",
        ),
    ],
    out: OutFolder,
    robot: Annotated[
        str | None, typer.Option(help="robot.yaml or a known name: whose joints these are")
    ] = None,
    name: Annotated[str | None, typer.Option(help="name for an imported robot")] = None,
    units: Annotated[str | None, typer.Option(help="unit of SA's points: mm, m, inch")] = None,
    euler: Annotated[str | None, typer.Option(help="order of three angles: zyx, xyz")] = None,
    names: Annotated[
        str | None,
        typer.Option(help="SA's names: collection-group-target, group-target, target, none"),
    ] = None,
    joints: Annotated[Path | None, typer.Option(help="CSV of the joints of SA's points")] = None,
    check: Annotated[
        Path | None, typer.Option(help="second file of the same format: rows held out")
    ] = None,
    sigma_mm: Annotated[
        float | None, typer.Option(min=1e-6, help="instrument, one standard deviation per axis")
    ] = None,
    sigma_ppm: Annotated[float | None, typer.Option(min=0.0, help="part per range")] = None,
    sigma_mrad: Annotated[float | None, typer.Option(min=1e-6, help="of orientations")] = None,
    *,
    as_json: AsJson = False,
) -> None:
    """Read another program's file: a robot becomes robot.yaml, measurements become a bundle."""
    from robocal.formats.formats import MEASUREMENT_READERS, ROBOT_READERS
    from robocal.formats.measured_table import DeclaredNoise, MeasurementOptions
    from robocal.formats.robot_import import RobotOptions

    arm = None if robot is None else _robot(robot)
    if file_format in ROBOT_READERS:
        notes = _convert_robot(file, file_format, out, RobotOptions(name, arm, euler))
    elif file_format in MEASUREMENT_READERS:
        if arm is None:
            raise BadInput("option --robot", "is missing: whose joints are these?")
        if sigma_mm is None:
            reason = "is missing: no file says how good the instrument is"
            raise BadInput("option --sigma-mm", reason)
        for option, value in (("mm", sigma_mm), ("ppm", sigma_ppm), ("mrad", sigma_mrad)):
            if value is not None and not math.isfinite(value):
                raise BadInput(f"option --sigma-{option}", f"must be a number, not {value}")
        noise = DeclaredNoise(sigma_mm, sigma_ppm, sigma_mrad)
        options = MeasurementOptions(units, euler, names, joints)
        files = {"": file} if check is None else {"fit": file, "check": check}
        notes = _convert_measurements(files, file_format, out, arm, noise, options)
    else:
        known = ", ".join((*ROBOT_READERS, *MEASUREMENT_READERS))
        raise BadInput("option --format", f"must be one of {known}, not '{file_format}'")
    if as_json:
        print(json.dumps({"format": file_format, "notes": notes, "out": str(out)}))
    else:
        print("\n".join([*notes, f"-> {out}"]))


def _robot(name: str) -> "Robot":
    from robocal.formats.robot_yaml import read_robot
    from robocal.robots.library import ROBOTS, load_robot

    return load_robot(name) if name in ROBOTS else read_robot(Path(name))


def _convert_robot(file: Path, file_format: str, out: Path, options: "RobotOptions") -> list[str]:
    from robocal.formats.formats import ROBOT_READERS
    from robocal.formats.measured_table import write_robot
    from robocal.formats.model_export import model_difference
    from robocal.formats.robot_yaml import read_robot

    imported = ROBOT_READERS[file_format](file, options)
    make_folder(out)
    write_robot(out / "robot.yaml", imported.robot)
    back = read_robot(out / "robot.yaml")
    difference = model_difference(imported.robot.geometry, back.geometry, back.limits)
    return [
        f"{imported.robot.name}: {imported.robot.n_joints} joints",
        *imported.notes,
        f"robot.yaml read back: largest difference {difference.position:.1e} m, "
        f"{difference.angle:.1e} rad over {difference.poses} poses",
    ]


def _convert_measurements(
    files: dict[str, Path],
    file_format: str,
    out: Path,
    arm: "Robot",
    noise: "DeclaredNoise",
    options: "MeasurementOptions",
) -> list[str]:
    from robocal.formats.bundle import read_bundle
    from robocal.formats.formats import MEASUREMENT_READERS
    from robocal.formats.measured_table import write_bundle

    tables = {
        split: MEASUREMENT_READERS[file_format](file, arm, options) for split, file in files.items()
    }
    make_folder(out)
    write_bundle(out, arm, noise, tables)
    bundle = read_bundle(out)
    notes = [
        f"{files[split].name}: {note}" for split, table in tables.items() for note in table.notes
    ]
    rejected = [
        f"measurements.csv line {row.line} not used: {row.reason}" for row in bundle.rejected
    ]
    return [*notes, *rejected, f"{len(bundle.measurements)} rows for {arm.name}"]

"""`robocal export`: a calibrated robot for another program."""

import json
from pathlib import Path
from typing import Annotated

import typer

from robocal.errors import BadInput
from service.commands.options import AsJson, warn_if_inadequate


def export(
    model: Annotated[Path, typer.Argument(metavar="MODEL.yaml")],
    file_format: Annotated[
        str, typer.Option("--format", help="urdf, ur-kinematics, robodk, mdh-json, mdh-csv")
    ],
    out: Annotated[Path, typer.Option("--out", help="file to write")],
    own_hash: Annotated[
        str | None,
        typer.Option(
            "--hash", help="UR: the robot's own hash (calib_...) or its own kinematics YAML"
        ),
    ] = None,
    euler: Annotated[
        str | None, typer.Option(help="RoboDK: order of three angles, zyx or xyz")
    ] = None,
    *,
    as_json: AsJson = False,
) -> None:
    """Write the calibrated geometry for another program, read it back and compare."""
    from robocal.calibrated import UNKNOWN_ROTATION
    from robocal.formats.formats import WRITERS
    from robocal.formats.model_export import ExportOptions, write_export
    from robocal.formats.model_yaml import read_model

    if file_format not in WRITERS:
        raise BadInput(
            "option --format", f"must be one of {', '.join(WRITERS)}, not '{file_format}'"
        )
    calibrated = read_model(model)
    made = WRITERS[file_format](calibrated, ExportOptions(own_hash, euler))
    difference = write_export(out, made)
    left_out = list(made.left_out)
    if not calibrated.tool_rotation_known:
        left_out.append(f"orientations of the tool are the flange's: {UNKNOWN_ROTATION}")
    if calibrated.effects:
        names = ", ".join(fitted.instance.title for fitted in calibrated.effects)
        left_out.append(f"the file holds geometry alone; what it leaves out: {names}")
    warn_if_inadequate(calibrated, model)
    if as_json:
        document = {
            "format": file_format,
            "poses": difference.poses,
            "largest_position_m": difference.position,
            "largest_angle_rad": difference.angle,
            "left_out": left_out,
            "out": str(out),
        }
        print(json.dumps(document, indent=2))
        return
    for sentence in left_out:
        print(f"note: {sentence}")
    print(
        f"read back, {difference.poses} poses: largest difference {difference.position:.1e} m, "
        f"{difference.angle:.1e} rad -> {out}"
    )

"""`robocal predict`."""

import json
from pathlib import Path
from typing import Annotated

import typer

from robocal.orientation_of import OrientationOf
from service.commands.options import AsJson, OutFile, warn, warn_if_inadequate


def predict(
    model: Annotated[Path, typer.Argument(metavar="MODEL.yaml")],
    poses: Annotated[Path, typer.Argument(metavar="POSES.csv")],
    out: OutFile,
    orientation_of: Annotated[
        OrientationOf | None,
        typer.Option(help="whose orientation qw ... qz shall state; the flange's if unknown"),
    ] = None,
    *,
    as_json: AsJson = False,
) -> None:
    """Tool poses of the calibrated robot at given joints."""
    from robocal.calibrated import UNKNOWN_BASE_ROTATION, UNKNOWN_ROTATION
    from robocal.formats.model_yaml import read_model
    from robocal.formats.poses_csv import predict_table

    calibrated = read_model(model)
    made = predict_table(calibrated, poses, out, orientation_of)
    warn_if_inadequate(calibrated, model)
    if made.unturned:
        warn(f"{made.unturned} rows have no quaternion: {UNKNOWN_ROTATION}")
    elif orientation_of is None and made.orientation_of is OrientationOf.flange:
        warn(f"the quaternions are the flange's: {UNKNOWN_ROTATION}")
    if not calibrated.base_rotation_known:
        warn(f"u_x_mm, u_y_mm, u_z_mm are empty: {UNKNOWN_BASE_ROTATION}")
    if calibrated.targets and calibrated.nest_covariance is None:
        warn(
            "u_x_mm, u_y_mm, u_z_mm of nests are empty: the model was written before it kept how "
            "sure their places are; identify the bundle again"
        )
    if made.at_end:
        warn(
            f"{made.at_end} rows are predicted as at the end of the model's campaign: its drift "
            "and steps go by t_s, which these rows, the campaign or the model do not state"
        )
    document = {
        "rows": made.rows,
        "rows_without_quaternion": made.unturned,
        "rows_at_end_of_campaign": made.at_end,
        "orientation_of": made.orientation_of,
        "out": str(out),
    }
    print(json.dumps(document) if as_json else f"{made.rows} poses -> {out}")

"""`robocal compensate`."""

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from robocal.errors import BadInput, NoAnswer
from robocal.orientation_of import OrientationOf
from service.commands.options import AsJson, OutFile, warn, warn_if_inadequate

_NAMED = 20
"""Targets that a person is told of one by one; the file and --json name them all."""


class Frame(StrEnum):
    """Where targets are stated."""

    measuring = "measuring"
    base = "base"


def compensate(
    model: Annotated[Path, typer.Argument(metavar="MODEL.yaml")],
    targets: Annotated[Path, typer.Argument(metavar="TARGETS.csv", help="x_mm ... qz a row")],
    out: OutFile,
    frame: Annotated[
        Frame, typer.Option(help="targets in the measuring frame or in the robot base")
    ] = Frame.measuring,
    orientation_of: Annotated[
        OrientationOf | None,
        typer.Option(help="whose orientation qw ... qz state; the flange's if the tool's unknown"),
    ] = None,
    *,
    as_json: AsJson = False,
) -> None:
    """Joints that really reach the wanted tool poses; names the targets that cannot be reached."""
    from robocal.calibrated import UNKNOWN_BASE_ROTATION, UNKNOWN_ROTATION
    from robocal.compensated_effects import compensate_robot
    from robocal.compensation import asked_for
    from robocal.formats.model_yaml import read_model
    from robocal.formats.targets_csv import read_targets, write_compensated
    from robocal.missed_targets import missed_sentence
    from robocal.reach import Reach

    calibrated = read_model(model)
    robot = calibrated.robot
    wanted = read_targets(targets, robot)
    asked = orientation_of
    calibrated, orientation_of = asked_for(calibrated, asked)
    if asked is None and orientation_of is OrientationOf.flange:
        warn(f"{targets.name}: orientations are taken as the flange's: {UNKNOWN_ROTATION}")
    if frame is Frame.measuring and not calibrated.base_rotation_known:
        warn(f"{targets.name}: state targets with --frame base: {UNKNOWN_BASE_ROTATION}")
    unturned = calibrated.unturned(wanted.rows)
    if unturned.any():
        raise BadInput(
            f"{targets.name} line {wanted.table.lines[unturned][0]}",
            f"asks for an orientation of the tool, but {UNKNOWN_ROTATION}; state tool_guess or "
            "measure full poses and identify again, or state orientations of the flange with "
            "--orientation-of flange",
        )
    try:
        result = compensate_robot(
            calibrated, wanted.wanted, wanted.rows, wanted.nominal_q, in_base=frame is Frame.base
        )
    except BadInput as error:
        raise error.within(targets.name) from None
    write_compensated(out, wanted, robot, result)
    missed = [row for row, reach in enumerate(result.reach) if reach is not Reach.reached]
    reached = len(result.reach) - len(missed)
    document = {
        "targets": len(result.reach),
        "reached": reached,
        "missed": [
            {
                "line": int(wanted.table.lines[row]),
                "status": str(result.reach[row]),
                "reason": missed_sentence(result, row, robot),
                "position_error_mm": float(result.position_error[row]) * 1e3,
            }
            for row in missed
        ],
        "out": str(out),
    }
    warn_if_inadequate(calibrated, model)
    if as_json:
        print(json.dumps(document, indent=2))
    else:
        for row in missed[:_NAMED]:
            print(
                f"{targets.name} line {wanted.table.lines[row]}: {result.reach[row]}: "
                f"{missed_sentence(result, row, robot)}"
            )
        if len(missed) > _NAMED:
            print(f"... and {len(missed) - _NAMED} more, see column 'status'")
        print(f"{reached} of {len(result.reach)} targets reached -> {out}")
    if not reached:
        kind = "identified" if calibrated.provenance.inadequate else "calibrated"
        raise NoAnswer(f"{targets.name}: the {kind} robot reaches none of the targets")

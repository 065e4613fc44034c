"""`robocal predict`."""

import json
from pathlib import Path
from typing import Annotated

import typer

from service.commands.options import AsJson, OutFile


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

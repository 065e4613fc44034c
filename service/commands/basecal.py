"""`robocal basecal`."""

import json
from pathlib import Path
from typing import Annotated

import typer

from service.commands.options import AsJson, OutFolder, make_folder, write_json


def basecal(
    stage: Annotated[Path, typer.Argument(metavar="STAGE.yaml")],
    out: OutFolder,
    draws: Annotated[int, typer.Option(min=100, max=1_000_000, help="Monte Carlo draws")] = 2_000,
    seed: Annotated[int, typer.Option(min=0)] = 1,
    *,
    as_json: AsJson = False,
) -> None:
    """Base-to-base transform of two robots from touches of the stage: writes basecal.json."""
    from robocal.base_calibration.monte_carlo import draw_registrations
    from robocal.base_calibration.projection import project
    from robocal.base_calibration.registration import register
    from robocal.formats.basecal_json import basecal_document
    from robocal.formats.stage import read_stage
    from service.basecal_lines import base_calibration_lines

    measured = read_stage(stage)
    result = register(measured.touches, measured.stage, measured.travel, measured.pair)
    projection = project(measured.touches, measured.stage)
    drawn = draw_registrations(result.solution, result.touches, result.stage, draws, seed)
    document = basecal_document(result, projection, drawn)
    make_folder(out)
    write_json(out / "basecal.json", document)
    if as_json:
        print(json.dumps(document, indent=2))
    else:
        print("\n".join(base_calibration_lines(result, projection, out)))

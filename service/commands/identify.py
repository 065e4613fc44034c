"""`robocal identify`."""

import json
from datetime import UTC, datetime
from typing import Annotated

import typer

from service.commands.options import AsJson, BundleFolder, OutFolder, make_folder, write_json


def identify(
    bundle: BundleFolder,
    out: OutFolder,
    strategy: Annotated[str, typer.Option(help="cross or simultaneous")] = "simultaneous",
    fix: Annotated[list[str] | None, typer.Option(help="keep a parameter nominal: d_4")] = None,
    free: Annotated[list[str] | None, typer.Option(help="identify it without prior: a_2")] = None,
    prior: Annotated[
        list[str] | None, typer.Option(help="its own standard deviation: a_2_mm=0.2")
    ] = None,
    *,
    as_json: AsJson = False,
) -> None:
    """Identify geometry, base and tool: writes identification.json and model.yaml."""
    from robocal.formats.identification_json import identification_document
    from robocal.formats.model_yaml import write_model
    from robocal.identification.priors import choices_of
    from service.calibration import calibrate
    from service.report_lines import identification_lines

    choices = choices_of(fix or [], free or [], prior or [])
    done = calibrate(bundle, strategy, datetime.now(UTC), choices)
    document = identification_document(done.result, done.folds)
    make_folder(out)
    write_json(out / "identification.json", document)
    write_model(out / "model.yaml", done.calibrated)
    if as_json:
        print(json.dumps(document, indent=2))
    else:
        print("\n".join(identification_lines(done, out)))

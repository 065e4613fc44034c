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
    make_folder(out)
    write_json(out / "identification.json", document)
    write_model(out / "model.yaml", calibrated)
    if as_json:
        print(json.dumps(document, indent=2))
    else:
        print("\n".join(identification_lines(measured, result, out)))

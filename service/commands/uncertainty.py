"""`robocal uncertainty`."""

import json
from datetime import UTC, datetime
from typing import Annotated

import typer

from service.commands.options import AsJson, BundleFolder, OutFolder, make_folder, write_json


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

    done = calibrate(bundle, "simultaneous", datetime.now(UTC))
    rows = done.bundle.measurements
    evaluation = evaluate_first(done.calibrated, rows.joints, draws, seed)
    document = uncertainty_document(evaluation, rows.lines, done.result.adequacy)
    make_folder(out)
    write_json(out / "uncertainty.json", document)
    if as_json:
        print(json.dumps(document, indent=2))
    else:
        tool = evaluation.draws
        print(
            f"tool position, {len(rows)} poses: U95 mean {tool.radius.mean() * 1e3:.4f} mm, "
            f"max {tool.radius.max() * 1e3:.4f} mm -> {out / 'uncertainty.json'}"
        )

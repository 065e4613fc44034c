"""`robocal station`."""

import json
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from service.commands.options import (
    AsJson,
    BundleFolder,
    OutFolder,
    json_text,
    make_folder,
    warn_if_inadequate,
)


def station(
    model: Annotated[Path, typer.Argument(metavar="MODEL.yaml")],
    bundle: BundleFolder,
    out: OutFolder,
    *,
    as_json: AsJson = False,
) -> None:
    """Take a calibrated robot to another station: fit base and tool alone, write model.yaml."""
    from robocal.formats.bundle import read_bundle
    from robocal.formats.model_yaml import model_text, read_model
    from robocal.formats.whole_file import write_together
    from robocal.stationing import station as fit_station
    from service.calibration import provenance_of
    from service.report_lines import not_used_lines

    measured = read_bundle(bundle)
    provenance = provenance_of(measured, "station", datetime.now(UTC))
    calibrated = read_model(model)
    found = fit_station(calibrated, measured, provenance)
    fit_rms = found.rms(held_out=False) * 1e3
    held_out_rms = found.rms(held_out=True) * 1e3 if found.held_out.any() else None
    document: dict[str, object] = {
        "fit": {"rows": int((~found.held_out).sum()), "position_rms_mm": fit_rms},
        "held_out": {"rows": int(found.held_out.sum()), "position_rms_mm": held_out_rms},
        "left_behind": list(found.left_behind),
        "rejected_rows": [asdict(row) for row in measured.rejected],
    }
    make_folder(out)
    write_together({
        out / "station.json": json_text(document),
        out / "model.yaml": model_text(found.calibrated),
    })
    warn_if_inadequate(calibrated, model)
    if as_json:
        print(json.dumps(document, indent=2))
        return
    print(f"base and tool fitted to {int((~found.held_out).sum())} rows: {fit_rms:.4f} mm RMS")
    if held_out_rms is not None:
        print(f"on {int(found.held_out.sum())} rows that were held out: {held_out_rms:.4f} mm RMS")
    for line in not_used_lines(measured.rejected):
        print(line)
    if found.left_behind:
        print(f"left behind with the earlier session: {', '.join(found.left_behind)}")
    print(f"-> {out / 'station.json'}, {out / 'model.yaml'}")

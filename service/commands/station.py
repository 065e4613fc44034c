"""`robocal station`."""

import json
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
    from robocal.stationing import on_known_robot
    from robocal.stationing import station as fit_station
    from service.calibration import provenance_of
    from service.sound_bundle import refuse_slips
    from service.station_lines import station_document, station_lines

    measured = read_bundle(bundle)
    calibrated = read_model(model)
    refuse_slips(on_known_robot(calibrated, measured))
    found = fit_station(calibrated, measured, provenance_of(measured, "station", datetime.now(UTC)))
    document = station_document(found, measured)
    make_folder(out)
    write_together({
        out / "station.json": json_text(document),
        out / "model.yaml": model_text(found.calibrated),
    })
    warn_if_inadequate(calibrated, model)
    if as_json:
        print(json.dumps(document, indent=2))
    else:
        print("\n".join(station_lines(found, measured, out)))

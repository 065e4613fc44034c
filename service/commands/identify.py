"""`robocal identify`."""

import json
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from robocal.errors import BadInput
from service.commands.options import AsJson, BundleFolder, OutFolder, json_text, make_folder

if TYPE_CHECKING:
    from robocal.data_faults.slip import Slip
    from robocal.formats.bundle import Bundle


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
    mend: Annotated[
        bool, typer.Option("--mend", help="mend slips of unit, sign or row order, and say so")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Identify geometry, base and tool: writes identification.json and model.yaml."""
    from robocal.formats.identification_json import identification_document
    from robocal.formats.model_yaml import model_text
    from robocal.formats.whole_file import write_together
    from robocal.identification.priors import choices_of
    from service.calibration import calibrate_bundle
    from service.report_lines import identification_lines

    asked = choices_of(fix or [], free or [], prior or [])
    measured, slips = _sound(bundle, wanted_mended=mend)
    chosen = measured.choices.overruled_by(asked)
    done = calibrate_bundle(replace(measured, choices=chosen), strategy, datetime.now(UTC))
    document = identification_document(done.result, done.folds)
    document["mended"] = [_mended(slip) for slip in slips]
    make_folder(out)
    write_together({
        out / "identification.json": json_text(document),
        out / "model.yaml": model_text(done.calibrated),
    })
    if as_json:
        print(json.dumps(document, indent=2))
    else:
        mended = [f"mended: {slip.sentence}" for slip in slips]
        print("\n".join([*mended, *identification_lines(done, out)]))


def _mended(slip: "Slip") -> dict[str, object]:
    return {
        "fault": slip.fault.value,
        "columns": list(slip.columns),
        "lines": list(slip.lines),
        "mend": slip.sentence,
    }


def _sound(folder: Path, *, wanted_mended: bool) -> tuple["Bundle", tuple["Slip", ...]]:
    """The bundle without slips, and those that were mended; `BadInput` if nobody asked to mend."""
    from robocal.data_faults.search import find_slips
    from robocal.data_faults.slip import mend
    from robocal.formats.bundle import read_bundle
    from service.sound_bundle import said

    bundle = read_bundle(folder)
    slips = find_slips(bundle)
    if slips and not wanted_mended:
        raise BadInput("measurements.csv", f"{said(slips)} (identify --mend does it)")
    return mend(bundle, slips), slips

"""`robocal identify`."""

import json
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from robocal.errors import BadInput
from service.commands.options import AsJson, BundleFolder, OutFolder, make_folder, write_json

if TYPE_CHECKING:
    from robocal.data_faults.slip import Slip
    from robocal.formats.bundle import Bundle
    from robocal.identification.priors import Choices
    from service.calibration import Calibration

_MOST_SENTENCES = 6


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
    from robocal.formats.model_yaml import write_model
    from robocal.identification.priors import choices_of
    from service.report_lines import identification_lines

    choices = choices_of(fix or [], free or [], prior or [])
    measured, slips = _sound(bundle, wanted_mended=mend)
    done = _calibrated(measured, strategy, choices)
    document = identification_document(done.result, done.folds)
    document["mended"] = [_mended(slip) for slip in slips]
    make_folder(out)
    write_json(out / "identification.json", document)
    write_model(out / "model.yaml", done.calibrated)
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

    bundle = read_bundle(folder)
    slips = find_slips(bundle)
    if slips and not wanted_mended:
        sentences = [slip.report() for slip in slips[:_MOST_SENTENCES]]
        more = len(slips) - len(sentences)
        said = "; and ".join((*sentences, *((f"{more} more slips",) if more else ())))
        raise BadInput("measurements.csv", f"{said} (identify --mend does it)")
    return mend(bundle, slips), slips


def _calibrated(bundle: "Bundle", strategy: str, choices: "Choices") -> "Calibration":
    """As `service.calibration.calibrate`, of a bundle that may no longer be what its files say."""
    from robocal.calibrated import Provenance
    from robocal.formats.model_yaml import calibrated_robot
    from robocal.identification.identify import identify as identify_bundle
    from robocal.identification.validation import cross_validate
    from service.calibration import Calibration

    bundle = replace(bundle, choices=bundle.choices.overruled_by(choices))
    result = identify_bundle(bundle, strategy)
    when = datetime.now(UTC).isoformat(timespec="seconds")
    provenance = Provenance(bundle.sha256, version("robocal"), when, strategy)
    robot = calibrated_robot(bundle.robot, result, bundle.gravity, provenance)
    return Calibration(bundle, result, cross_validate(bundle, result), robot)

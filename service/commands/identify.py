"""`robocal identify`."""

import json
from datetime import UTC, datetime

from service.chosen_bundle import (
    DEFAULT_STRATEGY,
    Fix,
    Free,
    Mend,
    Prior,
    Strategy,
    read_chosen,
)
from service.commands.options import AsJson, BundleFolder, OutFolder, json_text, make_folder
from service.progress_bar import progress_bar


def identify(
    bundle: BundleFolder,
    out: OutFolder,
    strategy: Strategy = DEFAULT_STRATEGY,
    fix: Fix = None,
    free: Free = None,
    prior: Prior = None,
    *,
    mend: Mend = False,
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
    with progress_bar(as_json=as_json):
        chosen = read_chosen(bundle, asked, wanted_mended=mend)
        done = calibrate_bundle(chosen.bundle, strategy, datetime.now(UTC))
    document = identification_document(done.result, done.folds)
    document["mended"] = chosen.mended
    make_folder(out)
    write_together({
        out / "identification.json": json_text(document),
        out / "model.yaml": model_text(done.calibrated),
    })
    if as_json:
        print(json.dumps(document, indent=2))
    else:
        print("\n".join([*chosen.sentences, *identification_lines(done, out)]))

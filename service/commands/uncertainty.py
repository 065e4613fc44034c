"""`robocal uncertainty`."""

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from service.chosen_bundle import (
    DEFAULT_STRATEGY,
    Fix,
    Free,
    Mend,
    Prior,
    Strategy,
    read_chosen,
)
from service.commands.options import AsJson, BundleFolder, OutFolder, make_folder, write_json
from service.progress_bar import progress_bar


def uncertainty(
    bundle: BundleFolder,
    out: OutFolder,
    poses: Annotated[
        Path | None, typer.Option(help="CSV of joints where the tool's uncertainty is wanted")
    ] = None,
    draws: Annotated[
        int | None, typer.Option(min=1000, max=1_000_000, help="fixed number; adaptive if left out")
    ] = None,
    digits: Annotated[int, typer.Option(min=1, max=2, help="numerical tolerance")] = 1,
    refits: Annotated[int, typer.Option(min=0, help="simulated campaigns, fitted again")] = 200,
    seed: Annotated[int, typer.Option(min=0)] = 1,
    strategy: Strategy = DEFAULT_STRATEGY,
    fix: Fix = None,
    free: Free = None,
    prior: Prior = None,
    *,
    mend: Mend = False,
    as_json: AsJson = False,
) -> None:
    """Uncertainty of parameters and tool by GUM and Monte Carlo: writes uncertainty.json."""
    from robocal.formats.poses_csv import read_poses
    from robocal.formats.uncertainty_json import uncertainty_document
    from robocal.identification.priors import choices_of
    from robocal.uncertainty.evaluation import JUDGING_SHARE, Settings, evaluate
    from robocal.uncertainty.workspace_map import map_workspace
    from service.calibration import calibrate_bundle
    from service.report_uncertainty import uncertainty_lines

    asked = choices_of(fix or [], free or [], prior or [])
    with progress_bar(as_json=as_json):
        chosen = read_chosen(bundle, asked, wanted_mended=mend)
        done = calibrate_bundle(chosen.bundle, strategy, datetime.now(UTC))
        rows = done.bundle.measurements
        if poses is None:
            q, lines = rows.joints, rows.lines
        else:
            wanted = read_poses(poses, done.bundle.robot)
            q, lines = wanted.joints, wanted.lines
        settings = Settings(seed, digits, draws, refits, JUDGING_SHARE)
        evaluation = evaluate(done.bundle, done.result, q, settings)
        workspace = map_workspace(done.bundle.robot, done.result.model, evaluation.sources, seed)
    document = uncertainty_document(evaluation, lines, workspace)
    document["mended"] = chosen.mended
    make_folder(out)
    write_json(out / "uncertainty.json", document)
    if as_json:
        print(json.dumps(document, indent=2))
    else:
        print("\n".join([*chosen.sentences, *uncertainty_lines(evaluation, workspace, out)]))

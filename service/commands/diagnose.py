"""`robocal diagnose`."""

import json
import os
from datetime import UTC, datetime

from service.commands.options import AsJson, BundleFolder, OutFolder, json_text, make_folder
from service.progress_bar import progress_bar


def diagnose(bundle: BundleFolder, out: OutFolder, *, as_json: AsJson = False) -> None:
    """Find what the model gets wrong: writes diagnosis.json, model.yaml, report.html."""
    # Thousands of small systems: threads would only wait for each other. It must be said before
    # the numerics library is loaded.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from robocal.diagnosis.diagnose import diagnose as find
    from robocal.formats.bundle import read_bundle
    from robocal.formats.diagnosis_json import NEXT_POSES, diagnosis_document
    from robocal.formats.model_yaml import model_text
    from robocal.formats.poses_csv import next_poses_text
    from robocal.formats.whole_file import write_together
    from service.calibration import provenance_of
    from service.diagnosis_report import report_html
    from service.report_lines import diagnosis_lines

    with progress_bar(as_json=as_json):
        measured = read_bundle(bundle)
        found = find(measured, provenance_of(measured, "simultaneous", datetime.now(UTC)))
        report = report_html(measured, found)
    document = diagnosis_document(found)
    texts = {
        out / "diagnosis.json": json_text(document),
        out / "model.yaml": model_text(found.calibrated),
        out / "report.html": report,
    }
    if len(found.next_poses.q):
        texts[out / NEXT_POSES] = next_poses_text(measured.robot, found.next_poses)
    make_folder(out)
    write_together(texts)
    if out / NEXT_POSES not in texts:
        # Of an earlier diagnosis into the same folder.
        (out / NEXT_POSES).unlink(missing_ok=True)
    if as_json:
        print(json.dumps(document, indent=2))
    else:
        print("\n".join(diagnosis_lines(found, out)))

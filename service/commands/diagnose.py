"""`robocal diagnose`."""

import json
import os
from datetime import UTC, datetime

from service.commands.options import AsJson, BundleFolder, OutFolder, make_folder, write_json


def diagnose(bundle: BundleFolder, out: OutFolder, *, as_json: AsJson = False) -> None:
    """Find what the model gets wrong: writes diagnosis.json, model.yaml, report.html."""
    # Thousands of small systems: threads would only wait for each other. It must be said before
    # the numerics library is loaded.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from robocal.diagnosis.diagnose import diagnose as find
    from robocal.formats.bundle import read_bundle
    from robocal.formats.diagnosis_json import NEXT_POSES, diagnosis_document
    from robocal.formats.model_yaml import write_model
    from robocal.formats.poses_csv import write_next_poses
    from service.calibration import provenance_of
    from service.diagnosis_report import write_report
    from service.report_lines import diagnosis_lines

    measured = read_bundle(bundle)
    found = find(measured, provenance_of(measured, "simultaneous", datetime.now(UTC)))
    document = diagnosis_document(found)
    make_folder(out)
    write_json(out / "diagnosis.json", document)
    write_model(out / "model.yaml", found.calibrated)
    if len(found.next_poses.q):
        write_next_poses(out / NEXT_POSES, measured.robot, found.next_poses)
    write_report(out / "report.html", measured, found)
    if as_json:
        print(json.dumps(document, indent=2))
    else:
        print("\n".join(diagnosis_lines(found, out)))

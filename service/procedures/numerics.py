"""The one place where the service calls robocal: a process of its own for every computation.

`python -m service.procedures.numerics OPERATION FOLDER` reads `request.json` in the folder and
writes `answer.json`. Exit status 2 with one sentence on standard error: the numbers or the input
do not allow an answer. Ends when its standard input closes, so that none outlives its worker.
"""

import json
import os
import sys
import threading
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from robocal.errors import RobocalError
from robocal.formats.bundle import read_bundle
from robocal.formats.identification_json import identification_document
from robocal.formats.model_yaml import model_document, read_model
from robocal.formats.robot_yaml import read_robot
from robocal.formats.uncertainty_json import uncertainty_document
from robocal.identification.identify import DEFAULT_STRATEGY
from robocal.planning.plan import plan_poses
from robocal.uncertainty.evaluation import evaluate
from robocal.verification import (
    accuracy_after,
    accuracy_before,
    accuracy_document,
    plan_verification,
)
from service.calibration import calibrate_bundle
from service.procedures.residual_rows import residual_rows, residual_rows_document
from service.sound_bundle import read_sound

Json = dict[str, Any]

REQUEST, ANSWER, MODEL = "request.json", "answer.json", "model.yaml"
NO_ANSWER = 2


def plan(request: Json, folder: Path) -> Json:
    """Plan the calibration of the robot in `robot.yaml` [rad, m]."""
    robot = read_robot(folder / "robot.yaml")
    return {"joints": plan_poses(robot, request["count"], request["seed"]).tolist()}


def plan_verify(request: Json, folder: Path) -> Json:
    """Find nominal and compensated joints for targets that no fit has seen [rad, m]."""
    targets = plan_verification(read_model(folder / MODEL), request["count"], request["seed"])
    return {
        "nominal": targets.q_nominal.tolist(),
        "compensated": targets.q_compensated.tolist(),
    }


def calibrate(request: Json, folder: Path) -> Json:
    """Identify from the bundle in the folder and evaluate its uncertainty."""
    when = datetime.fromisoformat(request["date"])
    done = calibrate_bundle(read_sound(folder), DEFAULT_STRATEGY, when)
    rows = done.bundle.measurements.fit_rows
    evaluation = evaluate(done.bundle, done.result, rows.joints)
    return {
        "bundle_sha256": done.bundle.sha256,
        "settings": {"strategy": DEFAULT_STRATEGY},
        "identification": {
            **identification_document(done.result, done.folds),
            "residual_rows": residual_rows_document(residual_rows(done.bundle, done.result)),
        },
        "model": model_document(done.calibrated),
        "uncertainty": uncertainty_document(evaluation, rows.lines),
    }


def verify(request: Json, folder: Path) -> Json:
    """Compare what was reached with what was wanted, before and after compensation."""
    calibrated = read_model(folder / MODEL)
    nominal = np.array(request["nominal_joints"])
    before = accuracy_before(calibrated, nominal, np.array(request["nominal_positions"]))
    after = accuracy_after(calibrated, nominal, np.array(request["compensated_positions"]))
    return {
        "bundle_sha256": read_bundle(folder).sha256,
        "settings": {},
        "verification": {"before": accuracy_document(before), "after": accuracy_document(after)},
    }


OPERATIONS: dict[str, Callable[[Json, Path], Json]] = {
    "plan": plan,
    "plan_verify": plan_verify,
    "calibrate": calibrate,
    "verify": verify,
}


def _end_with_parent() -> None:
    sys.stdin.read()
    os._exit(1)


def main() -> int:
    """Run one operation."""
    operation, folder = sys.argv[1], Path(sys.argv[2])
    threading.Thread(target=_end_with_parent, daemon=True).start()
    request = json.loads((folder / REQUEST).read_text(encoding="utf-8"))
    try:
        answer = OPERATIONS[operation](request, folder)
    except RobocalError as error:
        sys.stderr.write(f"{error}\n")
        return NO_ANSWER
    (folder / ANSWER).write_text(json.dumps(answer, allow_nan=False), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())

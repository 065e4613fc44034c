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
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from robocal.errors import RobocalError
from robocal.formats.identification_json import identification_document
from robocal.formats.model_yaml import model_document, read_model
from robocal.formats.robot_yaml import read_robot
from robocal.formats.uncertainty_json import uncertainty_document
from robocal.health.poses import health_poses
from robocal.identification.identify import DEFAULT_STRATEGY
from robocal.identification.priors import choices_of
from robocal.planning.clear_order import clear_order, with_room
from robocal.planning.open_parameters import open_parameters
from robocal.planning.plan import plan_poses
from robocal.uncertainty.evaluation import evaluate
from robocal.uncertainty.workspace_map import map_workspace
from robocal.verification import plan_verification
from service.calibration import calibrate_bundle
from service.cells.bounds import narrowed, surroundings
from service.cells.models import NewCell
from service.procedures.base_numerics import assess_base, calibrate_base
from service.procedures.find_causes import find_causes
from service.procedures.judge_health import judge_health
from service.procedures.residual_rows import residual_rows, residual_rows_document
from service.procedures.verify import verify
from service.sound_bundle import read_sound

Json = dict[str, Any]

REQUEST, ANSWER, MODEL = "request.json", "answer.json", "model.yaml"
CELL = "cell.json"
NO_ANSWER = 2
PATIENCE = 15
"""Added to the priority's number: whoever looks after a moving arm comes first."""


def plan(request: Json, folder: Path) -> Json:
    """Plan the calibration of the robot in `robot.yaml`, in its cell [rad, m]."""
    settings = _cell(folder)
    robot = narrowed(read_robot(folder / "robot.yaml"), settings.limits)
    roomy = with_room(surroundings(settings))
    q = plan_poses(robot, request["count"], request["seed"], roomy)
    order = clear_order(robot, surroundings(settings), q)
    return {"joints": q[order].tolist()}


def plan_verify(request: Json, folder: Path) -> Json:
    """Find nominal and compensated joints for targets that no fit has seen [rad, m]."""
    settings = _cell(folder)
    calibrated = read_model(folder / MODEL)
    robot = narrowed(calibrated.robot, settings.limits)
    targets = plan_verification(
        replace(calibrated, robot=robot),
        request["count"],
        request["seed"],
        payload=request["payload_kg"] or 0.0,
        cell=with_room(surroundings(settings)),
    )
    order = clear_order(robot, surroundings(settings), targets.q_nominal)
    return {
        "nominal": targets.q_nominal[order].tolist(),
        "compensated": targets.q_compensated[order].tolist(),
    }


def plan_health(request: Json, folder: Path) -> Json:
    """Poses that show best whether base, tool, a joint or the temperature moved [rad, m]."""
    settings = _cell(folder)
    calibrated = read_model(folder / MODEL)
    robot = narrowed(calibrated.robot, settings.limits)
    roomy = with_room(surroundings(settings))
    calibrated = replace(calibrated, robot=robot)
    q = health_poses(calibrated, request["count"], request["seed"], roomy)
    order = clear_order(robot, surroundings(settings), q)
    return {"joints": q[order].tolist()}


def calibrate(request: Json, folder: Path) -> Json:
    """Identify from the bundle in the folder and evaluate its uncertainty."""
    when = datetime.fromisoformat(request["date"])
    asked = request.get("settings", {})
    strategy = asked.get("strategy", DEFAULT_STRATEGY)
    measured = read_sound(folder)
    choices = choices_of(*(asked.get(wish, []) for wish in ("fix", "free", "prior")))
    chosen = measured.choices.overruled_by(choices)
    done = calibrate_bundle(replace(measured, choices=chosen), strategy, when)
    rows = done.bundle.measurements.fit_rows
    evaluation = evaluate(done.bundle, done.result, rows.joints)
    sources = evaluation.sources
    workspace = map_workspace(done.bundle.robot, done.result.model, sources, seed=0)
    return {
        "bundle_sha256": done.bundle.sha256,
        "settings": {"strategy": strategy} | asked,
        "identification": {
            **identification_document(done.result, done.folds),
            "residual_rows": residual_rows_document(residual_rows(done.bundle, done.result)),
        },
        "model": model_document(done.calibrated),
        "uncertainty": uncertainty_document(evaluation, rows.lines, workspace),
    }


def left_open(request: Json, folder: Path) -> Json:
    """Name the parameters that the measured joints [rad, m] do not determine."""
    robot = read_robot(folder / "robot.yaml")
    q = np.array(request["joints"], dtype=float).reshape(-1, robot.n_joints)
    return {"open": open_parameters(robot, q, sees_orientation=request["sees_orientation"])}


OPERATIONS: dict[str, Callable[[Json, Path], Json]] = {
    "plan": plan,
    "plan_verify": plan_verify,
    "calibrate": calibrate,
    "verify": verify,
    "left_open": left_open,
    "assess_base": assess_base,
    "calibrate_base": calibrate_base,
    "diagnose": find_causes,
    "plan_health": plan_health,
    "health": judge_health,
}


def _cell(folder: Path) -> NewCell:
    return NewCell.model_validate_json((folder / CELL).read_bytes())


def _end_with_parent() -> None:
    sys.stdin.read()
    os._exit(1)


def main() -> int:
    """Run one operation."""
    operation, folder = sys.argv[1], Path(sys.argv[2])
    if sys.platform != "win32":
        os.nice(PATIENCE)
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

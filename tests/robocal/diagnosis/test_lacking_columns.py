"""A payload or approach that a row leaves out is unknown, not none, where the campaign had it."""

from dataclasses import replace

import numpy as np
import pytest

from robocal.calibrated import CalibratedRobot
from robocal.diagnosis.effect import Coefficient, Instance
from robocal.diagnosis.extended import FittedEffect
from robocal.diagnosis.reference import Reference
from robocal.errors import BadInput
from robocal.formats.model_yaml import read_model, write_model
from robocal.measurements import unmeasured_rows
from robocal.verification import plan_verification
from tests.measured_cell import true_cell, write_bundle
from tests.robocal.formats.calibrated_arms import calibrated_arm

SIDES = tuple(f"approach{joint}" for joint in range(1, 7))
JOINTS = ",".join(f"j{joint}_deg" for joint in range(1, 7))
ROW = "10,-80,95,-100,-85,10"
UNITS = {"backlash": "width_rad", "joint_thermal_drift": "zero_rad_per_k"}


def yielding(*effects: tuple[str, int], complete: tuple[str, ...]) -> CalibratedRobot:
    """A robot with effects, learnt from rows that filled some columns."""
    fitted = []
    for name, joint in effects:
        coefficient = Coefficient(UNITS.get(name, "compliance_rad_per_nm"), 1e-3)
        instance = Instance(name, joint, (), (coefficient,))
        fitted.append(FittedEffect(instance, np.array([1e-5]), np.eye(1) * 1e-12))
    arm = calibrated_arm("ur10e").calibrated
    return replace(arm, effects=tuple(fitted), reference=Reference(complete=frozenset(complete)))


def predict(call, folder, robot, header: str, *rows: str) -> tuple[int, str]:
    write_model(folder / "model.yaml", robot)
    (folder / "poses.csv").write_text("\n".join([header, *rows]) + "\n")
    status, _, said = call(
        "predict", folder / "model.yaml", folder / "poses.csv", "--out", folder / "out.csv"
    )
    return status, said


@pytest.mark.parametrize("effect", ["payload_compliance", "joint_compliance"])
def test_a_row_without_the_payload_that_a_joint_yields_to_is_refused(call, tmp_path, effect):
    robot = yielding((effect, 3), complete=("payload_kg",))
    status, said = predict(call, tmp_path, robot, f"{JOINTS},payload_kg", f"{ROW},0", f"{ROW},")
    assert status == 2
    assert said == (
        "robocal: poses.csv line 3: lacks payload_kg, which the model's effects need "
        f"({effect} J3)\n"
    )


def test_a_row_without_the_side_that_a_joint_with_play_came_from_is_refused(call, tmp_path):
    robot = yielding(("backlash", 5), complete=SIDES)
    status, said = predict(call, tmp_path, robot, JOINTS, ROW)
    assert status == 2
    assert said == (
        "robocal: poses.csv line 2: lacks approach5, which the model's effects need (backlash J5)\n"
    )
    assert predict(call, tmp_path, robot, f"{JOINTS},approach5", f"{ROW},-1") == (0, "")


def test_all_columns_that_a_row_lacks_are_named_and_no_other(call, tmp_path):
    effects = ("payload_compliance", 3), ("joint_thermal_drift", 2), ("backlash", 5)
    robot = yielding(*effects, complete=("payload_kg", *SIDES))
    status, said = predict(call, tmp_path, robot, f"{JOINTS},approach5", f"{ROW},1")
    assert status == 2
    assert "line 2: lacks payload_kg and temperature_degc, which" in said
    assert "(payload_compliance J3, joint_thermal_drift J2)" in said


def test_what_the_campaign_left_out_too_counts_as_none(call, tmp_path):
    robot = yielding(("joint_compliance", 3), ("backlash", 5), complete=())
    assert predict(call, tmp_path, robot, JOINTS, ROW) == (0, "")


@pytest.mark.parametrize(
    ("effect", "column"), [("payload_compliance", "payload_kg"), ("backlash", "approach3")]
)
def test_a_model_from_before_columns_were_kept_needs_what_its_effects_are_of(
    tmp_path, effect, column
):
    path = tmp_path / "model.yaml"
    write_model(path, yielding((effect, 3), complete=(*SIDES, "payload_kg")))
    lines = path.read_text().splitlines()
    path.write_text("\n".join(line for line in lines if "complete_columns" not in line) + "\n")
    assert read_model(path).reference.complete == {column}


def test_a_station_whose_rows_lack_the_payload_is_refused(call, tmp_path):
    write_model(
        tmp_path / "model.yaml",
        yielding(("payload_compliance", 3), complete=("payload_kg",)),
    )
    write_bundle(tmp_path / "there", "ur10e", true_cell("ur10e", 7), 40, 8, full_pose=False)
    status, _, said = call(
        "station", tmp_path / "model.yaml", tmp_path / "there", "--out", tmp_path / "out"
    )
    assert status == 2
    assert "measurements.csv line 2: lacks payload_kg, which the model's effects need" in said
    assert not (tmp_path / "out").exists()


def test_a_verification_comes_from_neither_side_but_must_know_the_payload():
    robot = yielding(("backlash", 3), complete=SIDES)
    assert len(plan_verification(robot, 5, 3).q_nominal) == 5
    loaded = yielding(("payload_compliance", 3), complete=("payload_kg",))
    with pytest.raises(BadInput, match=r"line \d+: lacks payload_kg, which"):
        plan_verification(loaded, 5, 3)
    assert len(plan_verification(loaded, 5, 3, payload=2.0).q_nominal) == 5


def test_how_sure_a_place_is_does_not_hang_on_what_no_effect_needs():
    robot = yielding(("joint_compliance", 3), complete=SIDES)
    rows = unmeasured_rows(np.deg2rad([[float(angle) for angle in ROW.split(",")]]))
    unsure = replace(rows, approach=np.full((1, 6), np.nan))
    assert np.isfinite(robot.position_covariance_of(unsure)).all()

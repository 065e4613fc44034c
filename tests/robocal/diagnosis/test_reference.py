"""Rows that a model predicts stand in its campaign where their t_s says, else at its end."""

import csv
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robocal.calibrated import CalibratedRobot
from robocal.compensated_effects import compensate_robot
from robocal.diagnosis.effect import Coefficient, Instance
from robocal.diagnosis.extended import FittedEffect
from robocal.diagnosis.reference import Reference, reference_of
from robocal.diagnosis.steps import after_step
from robocal.formats.effects_yaml import reference_document
from robocal.formats.model_yaml import read_model, write_model
from robocal.measurements import unmeasured_rows
from tests.robocal.formats.calibrated_arms import calibrated_arm

START, SPAN = 1.7e9, 8000.0
"""Of the campaign, by the seconds of a computer's clock."""
JOINTS = "10,-80,95,-100,-85,10"
STEP = (("line", 50.0), ("last_line_before", 48.0))
MOMENTS = ((48.0, START + 3000.0), (49.0, START + 3060.0), (50.0, START + 3180.0))
SECONDS = Reference(START, SPAN, moments=MOMENTS)
SHARES = Reference(0.0, 0.995, timed=False)


def moved_base(effect: str, arguments, reference: Reference) -> CalibratedRobot:
    """A robot whose base ends a millimetre off along one axis."""
    arm = calibrated_arm("ur10e").calibrated
    name = "drift" if effect == "base_drift" else "step"
    coefficients = tuple(Coefficient(f"{name}_{axis}_m", 1e-3) for axis in "xyz")
    instance = Instance(effect, None, arguments, coefficients)
    fitted = FittedEffect(instance, np.array([1e-3, 0.0, 0.0]), np.eye(3) * 1e-12)
    return replace(arm, effects=(fitted,), reference=reference)


def predicted(call, folder: Path, calibrated: CalibratedRobot, times: list[str] | None):
    """How far off the geometry alone `robocal predict` puts each row [mm], and what it said."""
    return by_file(call, folder, calibrated, folder / "model.yaml", times)


def by_file(call, folder, calibrated, model, times):
    if not model.exists():
        write_model(model, calibrated)
    head = ",".join(f"j{joint}_deg" for joint in range(1, 7))
    lines = [head + ",t_s", *(f"{JOINTS},{time}" for time in times or ())]
    if times is None:
        lines = [head, JOINTS, JOINTS]
    (folder / "poses.csv").write_text("\n".join(lines) + "\n")
    status, _, said = call("predict", model, folder / "poses.csv", "--out", folder / "out.csv")
    assert status == 0, said
    with (folder / "out.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    places = np.array([[float(row[f"{axis}_mm"]) for axis in "xyz"] for row in rows])
    q = np.deg2rad([[float(angle) for angle in JOINTS.split(",")]])
    away = places - 1e3 * calibrated.tool_poses(q)[0, :3, 3]
    return np.linalg.norm(away, axis=1), said


def test_a_drift_goes_by_the_time_of_each_row(call, tmp_path):
    robot = moved_base("base_drift", (), SECONDS)
    times = [f"{START + share * SPAN}" for share in (0.0, 0.25, 1.0)]
    moved, said = predicted(call, tmp_path, robot, times)
    np.testing.assert_allclose(moved, [0.0, 0.25, 1.0], atol=1e-6)
    assert said == ""


def test_one_row_alone_has_its_time_too(call, tmp_path):
    robot = moved_base("base_drift", (), SECONDS)
    moved, _ = predicted(call, tmp_path, robot, [f"{START + 0.5 * SPAN}"])
    np.testing.assert_allclose(moved, [0.5], atol=1e-6)


def test_before_and_after_the_campaign_a_drift_stands_as_at_its_ends(call, tmp_path):
    robot = moved_base("base_drift", (), SECONDS)
    moved, _ = predicted(call, tmp_path, robot, ["12.5", f"{START + 90 * SPAN}"])
    np.testing.assert_allclose(moved, [0.0, 1.0], atol=1e-6)


@pytest.mark.parametrize(
    ("reference", "times", "expected"),
    [
        (SECONDS, None, [1.0, 1.0]),
        (SECONDS, ["", f"{START + 0.5 * SPAN}"], [1.0, 0.5]),
        (SHARES, ["100", "200"], [1.0, 1.0]),
        (SHARES, None, [1.0, 1.0]),
    ],
)
def test_rows_that_nothing_places_stand_at_the_end_which_is_said(
    call, tmp_path, reference, times, expected
):
    robot = moved_base("base_drift", (), reference)
    moved, said = predicted(call, tmp_path, robot, times)
    np.testing.assert_allclose(moved, expected, atol=1e-6)
    assert f"{expected.count(1.0)} rows are predicted as at the end of the model's campaign" in said


def test_a_step_goes_by_time_whatever_the_lines_of_the_file(call, tmp_path):
    robot = moved_base("base_step", STEP, SECONDS)
    times = [f"{START + t}" for t in (7000.0, 10.0, 3000.0, 3060.0, 3180.0)]
    moved, said = predicted(call, tmp_path, robot, times)
    np.testing.assert_allclose(moved, [1.0, 0.0, 0.0, 0.5, 1.0], atol=1e-6)
    assert said == ""


@pytest.mark.parametrize("reference", [SECONDS, SHARES])
def test_without_a_time_what_stepped_has_stepped(call, tmp_path, reference):
    moved, said = predicted(call, tmp_path, moved_base("base_step", STEP, reference), None)
    np.testing.assert_allclose(moved, [1.0, 1.0], atol=1e-6)
    assert "2 rows are predicted as at the end" in said


@pytest.mark.parametrize(("reference", "expected"), [(SECONDS, 0.25), (SHARES, 1.0)])
def test_a_file_from_before_the_kind_of_time_was_kept_tells_it_by_its_numbers(
    call, tmp_path, reference, expected
):
    robot, model = moved_base("base_drift", (), reference), tmp_path / "model.yaml"
    write_model(model, robot)
    added = r"\n  (time_is_seconds|complete_columns|step_lines|step_t_s): .*"
    older, count = re.subn(added, "", model.read_text())
    assert count == 4
    model.write_text(older)
    assert read_model(model).reference.timed == reference.timed
    moved, _ = by_file(call, tmp_path, robot, model, [f"{START + 0.25 * SPAN}"])
    np.testing.assert_allclose(moved, [expected], atol=1e-6)


def test_compensated_joints_and_their_prediction_mean_the_same_moment():
    robot = moved_base("base_drift", (), SECONDS)
    q = np.deg2rad([[float(angle) for angle in JOINTS.split(",")]] * 2)
    rows = replace(unmeasured_rows(q), time=np.array([START + 2000.0, np.nan]))
    wanted = robot.tool_poses(q)
    found = compensate_robot(robot, wanted, rows, q, in_base=False)
    there = robot.poses_of(replace(rows, joints=found.q))
    np.testing.assert_allclose(there, wanted, atol=1e-8)
    away = np.linalg.norm((robot.tool_poses(found.q) - wanted)[:, :3, 3], axis=1)
    np.testing.assert_allclose(away, [0.25e-3, 1e-3], rtol=1e-3)


def test_a_campaigns_own_rows_find_their_lines_by_their_times():
    """Those between the two rows of a step included, whatever the rest of the file is."""
    robot = moved_base("base_step", STEP, SECONDS)
    rng = np.random.default_rng(3)
    rows = replace(
        unmeasured_rows(np.zeros((90, 6))),
        lines=np.arange(2, 92),
        time=np.cumsum(rng.uniform(20.0, 60.0, 90)),
    )
    reference = reference_of(rows, rows.time)
    assert reference.timed
    part = rows.rows(np.arange(90) % 2 == 0)
    around = replace(robot, reference=reference).circumstances_of(part)
    moved = after_step(around, robot.effects[0].instance)
    np.testing.assert_array_equal(moved, np.clip((part.lines - 48) / 2.0, 0.0, 1.0))


def test_lines_out_of_the_order_of_time_do_not_place_a_step():
    rows = replace(unmeasured_rows(np.zeros((4, 6))), time=np.array([1.0, 3.0, 2.0, 4.0]))
    assert reference_of(rows, rows.time).moments == ()


def test_a_step_between_rows_of_one_time_is_placed_by_no_time():
    robot = moved_base("base_step", STEP, SECONDS)
    rows = replace(
        unmeasured_rows(np.zeros((90, 6))),
        lines=np.arange(2, 92),
        time=np.repeat([0.0, 3600.0, 7200.0], 30),
    )
    written = reference_document(reference_of(rows, rows.time), robot.effects)
    assert written["step_lines"] == written["step_t_s"] == []
    sharp = replace(rows, time=np.arange(90.0))
    assert reference_document(reference_of(sharp, sharp.time), robot.effects)["step_t_s"]

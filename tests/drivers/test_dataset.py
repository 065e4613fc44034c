"""The program that writes hidden cases, against kinematics of another hand."""

import csv
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.elementary_kinematics import Arm, arm_from_document, shift, turn

ROOT = Path(__file__).parents[2]
TX60 = ROOT / "tests" / "blind" / "robots" / "staubli_tx60_with_masses.yaml"
SIGMA_MM = 0.03


def program(name: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", f"drivers.emulators.{name}", *map(str, arguments)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )


def write(folder: Path, *arguments: object) -> None:
    places = ("--out", folder / "bundles", "--truth", folder / "truth")
    done = program("dataset", "--robot", TX60, *places, *arguments)
    assert done.returncode == 0, done.stderr


def truth_of(folder: Path, index: int = 0) -> dict:
    return json.loads((folder / "truth" / f"{index:04d}.json").read_text())


def rows_of(bundle: Path) -> dict[str, np.ndarray]:
    with (bundle / "measurements.csv").open() as sheet:
        rows = list(csv.DictReader(sheet))
    return {
        name: np.array([row[name] if name == "split" else float(row[name]) for row in rows])
        for name in rows[0]
    }


def joints(rows: dict[str, np.ndarray]) -> np.ndarray:
    return np.radians(np.column_stack([rows[f"j{j}_deg"] for j in range(1, 7)]))


def position(rows: dict[str, np.ndarray]) -> np.ndarray:
    return np.column_stack([rows[f"{axis}_mm"] for axis in "xyz"])


def true_arm(folder: Path, index: int = 0) -> Arm:
    """The true geometry, without the hidden effects."""
    truth = truth_of(folder, index)
    robot = folder / "bundles" / f"{index:04d}" / "robot.yaml"
    names = ("theta", "d", "a", "alpha", "beta")
    links = np.column_stack([truth["links"][name] for name in names])
    nominal = arm_from_document(yaml.safe_load(robot.read_text()))
    return replace(nominal, links=links).within(np.array(truth["base"]), np.array(truth["tool"]))


def misses(folder: Path, index: int = 0) -> np.ndarray:
    """Measured less true geometry, row by row [mm]."""
    rows = rows_of(folder / "bundles" / f"{index:04d}")
    arm = true_arm(folder, index)
    return position(rows) - arm.poses(joints(rows))[:, :3, 3] * 1e3


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clean")
    write(folder, "--kind", "clean", "--seed", 4, "--count", 2)
    return folder


def test_a_clean_case_is_the_true_geometry_and_the_stated_noise(clean):
    left = misses(clean)
    # 534 coordinates: their standard deviation is known to 3 %.
    assert left.std() == pytest.approx(SIGMA_MM, rel=0.1)
    assert abs(left.mean()) < 4 * SIGMA_MM / left.size**0.5


def test_a_bundle_holds_nothing_but_its_three_files(clean):
    names = sorted(path.name for path in (clean / "bundles" / "0000").iterdir())
    assert names == ["campaign.yaml", "measurements.csv", "robot.yaml"]


def test_a_campaign_has_poses_repeats_and_rows_to_check(clean):
    rows = rows_of(clean / "bundles" / "0000")
    fit = rows["split"] == "fit"
    assert (fit.sum(), (~fit).sum()) == (138, 40)
    assert len(np.unique(rows["pose"][fit])) == 120
    visits = np.unique(rows["pose"], return_counts=True)[1]
    assert np.bincount(visits).tolist() == [0, 151, 0, 9]
    assert set(rows["payload_kg"]) == {0.0, 2.0, 4.0}
    assert np.ptp(rows["temperature_degc"]) > 10


def test_the_directions_of_approach_are_those_of_the_moves(clean):
    rows = rows_of(clean / "bundles" / "0000")
    moved = np.sign(np.diff(joints(rows), axis=0))
    told = np.column_stack([rows[f"approach{j}"] for j in range(1, 7)])[1:]
    assert (moved == told).all()


def test_the_same_seed_writes_the_same_case_whatever_the_count(clean, tmp_path):
    write(tmp_path, "--kind", "clean", "--seed", 4)
    name = "bundles/0000/measurements.csv"
    assert (tmp_path / name).read_text() == (clean / name).read_text()
    other = "bundles/0001/measurements.csv"
    assert (tmp_path / name).read_text() != (clean / other).read_text()


VISIBLE = (
    "joint_compliance",
    "payload_compliance",
    "link_bending",
    "base_compliance",
    "thermal_expansion",
    "gear_harmonic",
    "base_step",
    "instrument_angle",
)


def geometry_columns(arm: Arm, q: np.ndarray) -> np.ndarray:
    """Derivatives of the positions by links, base and tool, by central differences."""
    step = 1e-6
    columns = []

    def column(wider: Arm, narrower: Arm) -> None:
        moved = wider.poses(q)[:, :3, 3] - narrower.poses(q)[:, :3, 3]
        columns.append(moved.ravel() / (2 * step))

    for place in np.ndindex(arm.links.shape):
        if place[1] == 4 and place[0] != 1:
            continue  # beta is a parameter behind parallel axes alone: behind joint 2 here
        change = np.zeros_like(arm.links)
        change[place] = step
        column(replace(arm, links=arm.links + change), replace(arm, links=arm.links - change))
    for name in ("base", "tool"):
        own = getattr(arm, name)
        for motion in (turn, shift):
            for axis in "xyz":
                wider, narrower = (own @ motion(axis, size) for size in (step, -step))
                column(replace(arm, **{name: wider}), replace(arm, **{name: narrower}))
    J = np.stack(columns, axis=1)
    length = np.linalg.norm(J, axis=0)
    # Turning the tool about the target moves no position.
    return J[:, length > 0] / length[length > 0]


@pytest.mark.parametrize("effect", VISIBLE)
def test_lambda_is_what_the_best_geometry_leaves_of_the_effect(tmp_path, effect):
    faint = 1e-4
    write(tmp_path, "--effect", effect, "--seed", 8, "--sigma-mm", faint)
    rows = rows_of(tmp_path / "bundles" / "0000")
    fit = rows["split"] == "fit"
    x = misses(tmp_path)[fit].ravel()
    J = geometry_columns(true_arm(tmp_path), joints(rows)[fit])
    left = x - J @ np.linalg.lstsq(J, x, rcond=1e-6)[0]
    (hidden,) = truth_of(tmp_path)["effects"]
    assert hidden["effect"] == effect
    # Noise of 0.0001 mm adds less than a part in a thousand to what is left.
    assert np.linalg.norm(left) / faint == pytest.approx(hidden["strength"], rel=5e-3)
    assert hidden["snr"] == pytest.approx(hidden["strength"] / x.size**0.5)


@pytest.mark.parametrize("fault", ["outlier", "swapped_rows", "row_shift"])
def test_a_fault_spoils_the_lines_that_the_truth_names(tmp_path, fault):
    write(tmp_path, "--kind", "data_fault", "--effect", fault, "--seed", 9)
    off = np.linalg.norm(misses(tmp_path), axis=1)
    named = truth_of(tmp_path)["fault"]
    assert named["fault"] == fault
    assert [int(row) + 2 for row in np.flatnonzero(off > 0.25)] == named["lines"]


def test_full_poses_carry_unit_quaternions(tmp_path):
    write(tmp_path, "--kind", "one", "--seed", 2, "--orientation")
    rows = rows_of(tmp_path / "bundles" / "0000")
    q = np.column_stack([rows[name] for name in ("qw", "qx", "qy", "qz")])
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1, atol=1e-9)


def test_a_background_holds_every_other_effect_faintly(tmp_path):
    write(tmp_path, "--kind", "background", "--effect", "base_step", "--seed", 2)
    effects = truth_of(tmp_path)["effects"]
    assert len({effect["effect"] for effect in effects}) == 19
    assert [effect["effect"] for effect in effects if effect["main"]] == ["base_step"]


def test_a_warm_up_without_a_sensor_has_no_temperature(tmp_path):
    write(tmp_path, "--effect", "warm_up", "--seed", 2)
    assert "temperature_degc" not in rows_of(tmp_path / "bundles" / "0000")


def test_a_follow_up_measures_the_asked_poses_on_the_same_cell(tmp_path):
    write(tmp_path, "--effect", "backlash", "--seed", 3)
    asked = tmp_path / "next.csv"
    header = [*(f"j{j}_deg" for j in range(1, 7)), *(f"approach{j}" for j in range(1, 7))]
    poses = [[10, 20, 30, 40, 50, 60, 1, -1, 1, 1, 1, 1], [-10, 0, 5, 6, 7, 8, 0, 0, 0, 0, 0, 0]]
    asked.write_text("\n".join(",".join(map(str, row)) for row in [header, *poses]) + "\n")
    old, new = tmp_path / "bundles" / "0000", tmp_path / "more"
    places = ("--bundle", old, "--truth", tmp_path / "truth" / "0000.json", "--out", new)
    done = program("follow_up", *places, "--poses", asked)
    assert done.returncode == 0, done.stderr
    before = (old / "measurements.csv").read_text().splitlines()
    after = (new / "measurements.csv").read_text().splitlines()
    assert after[: len(before)] == before
    rows = rows_of(new)
    np.testing.assert_allclose(np.degrees(joints(rows))[-2:, :2], [[10, 20], [-10, 0]])
    assert [rows["approach2"][-2], rows["approach1"][-1]] == [-1, -1]
    assert rows["split"][-1] == "fit"
    assert rows["t_s"][-1] > rows["t_s"][-3]


def test_a_robot_without_masses_is_refused_in_one_line(tmp_path):
    bare = ROOT / "robocal" / "robots" / "staubli_tx60.yaml"
    places = ("--out", tmp_path / "b", "--truth", tmp_path / "t")
    done = program("dataset", "--robot", bare, *places, "--seed", 1)
    assert done.returncode == 2
    assert done.stderr == "the robot's file has no links with masses; add them.\n"


def test_an_arm_whose_loads_keep_their_side_hides_no_play_under_load(tmp_path):
    """A SCARA's joints turn about upright axes."""
    document = yaml.safe_load((ROOT / "robocal" / "robots" / "abb_irb910sc.yaml").read_text())
    scara = tmp_path / "scara.yaml"
    masses = [{"mass_kg": mass, "com_mm": [-100, 0, 40]} for mass in (7.0, 5.0, 2.0, 0.4)]
    scara.write_text(yaml.safe_dump(document | {"links": masses}))
    places = ("--robot", scara, "--out", tmp_path / "b", "--truth", tmp_path / "truth")
    done = program("dataset", *places, "--kind", "background", "--seed", 1)
    assert done.returncode == 0, done.stderr
    names = {effect["effect"] for effect in truth_of(tmp_path)["effects"]}
    assert len(names) == 18
    assert "load_backlash" not in names
    refused = program("dataset", *places, "--effect", "load_backlash", "--seed", 1)
    assert refused.returncode == 2
    assert refused.stderr == "no joint's load changes side; hide another effect.\n"

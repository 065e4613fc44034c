"""Slips are named with their exact mend, and sound data are not blamed."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robocal.data_faults.search import find_slips
from robocal.data_faults.slip import Fault, mend
from robocal.errors import NoAnswer
from robocal.formats.bundle import read_bundle
from tests.robocal.data_faults import spoiled
from tests.robocal.data_faults.slip_study import (
    alarm_on_sound_data,
    gives_back,
    is_right,
    spoil_and_find,
)
from tests.robocal.data_faults.spoiled import Campaign, Slipper, Spoiled

SHARED = Path(__file__).parents[3].parent / "shared" / "data"
KINDS = (*spoiled.SLIPS, *spoiled.SCARA_SLIPS, *spoiled.POSE_SLIPS)


def find(folder: Path, table: spoiled.Table, robot: str):
    table.write(folder, robot)
    return find_slips(read_bundle(folder))


def robot_for(kind: Slipper) -> str:
    return "abb_irb910sc" if kind in spoiled.SCARA_SLIPS else "ur10e"


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_every_kind_of_slip_is_named_with_the_mend_that_undoes_it(tmp_path, kind):
    """Oracle: the mended rows are the rows from before the slip."""
    robot = robot_for(kind)
    table = Campaign(robot, seed=4, rows=50, outliers=0.02, sag_mm=1.0).measure()
    fault = kind(table, np.random.default_rng(3))
    table.write(tmp_path / "sound", robot)
    slips = find(tmp_path / "spoiled", fault.table, robot)
    bundle, sound = read_bundle(tmp_path / "spoiled"), read_bundle(tmp_path / "sound")
    assert is_right(fault, slips, bundle, sound), [slip.report() for slip in slips]
    mended = mend(bundle, slips)
    assert mended.sha256 == bundle.sha256
    assert find_slips(mended) == ()


def test_seeded_slips_of_every_kind_are_named(tmp_path):
    """The study itself, reduced: 30 slips."""
    trials = [spoil_and_find(tmp_path / str(seed), seed) for seed in range(30)]
    missed = [trial for trial in trials if not trial.right]
    assert not missed


def test_sound_data_are_not_blamed(tmp_path):
    """Six robots, 15 to 100 rows, some with outliers or sagging joints, some in small volumes."""
    said = [alarm_on_sound_data(tmp_path / str(seed), seed) for seed in range(30)]
    assert not any(said), [text for text in said if text]


def real(name: str) -> Path:
    folder = SHARED / name
    if not folder.is_dir():
        pytest.skip(f"the measured campaign '{name}' is not beside the checkout")
    return folder


@pytest.mark.parametrize("name", ["ur5", "ipa_ur10_a", "ipa_ur10_b"])
def test_real_campaigns_are_not_blamed(name):
    assert find_slips(read_bundle(real(name))) == ()


def respelled(source: Path, target: Path, change) -> Path:
    """A copy of a real bundle with a changed measurements.csv, told by column names."""
    target.mkdir()
    for file in ("robot.yaml", "campaign.yaml"):
        (target / file).write_text((source / file).read_text())
    header, *lines = (source / "measurements.csv").read_text().splitlines()
    names = header.split(",")
    rows = [dict(zip(names, line.split(","), strict=True)) for line in lines[:1500]]
    change(rows)
    text = "\n".join([header, *(",".join(row.values()) for row in rows)])
    (target / "measurements.csv").write_text(text + "\n")
    return target


def sign_of_joint_4(rows) -> None:
    for row in rows:
        row["j4_deg"] = str(-float(row["j4_deg"]))


def metres(rows) -> None:
    for row in rows:
        for column in spoiled.POSITION:
            row[column] = f"{float(row[column]) / 1e3:.9f}"


def one_reading_lost(rows) -> None:
    columns = [c for c in (*spoiled.POSITION, *spoiled.QUATERNION) if c in rows[0]]
    for row, after in pairwise(rows[700:]):
        row.update({column: after[column] for column in columns})
    del rows[-1]


def scalar_last(rows) -> None:
    for row in rows:
        w, x, y, z = (row[column] for column in spoiled.QUATERNION)
        row.update(qw=x, qx=y, qy=z, qz=w)


@pytest.mark.parametrize(
    ("name", "change", "sentence"),
    [
        ("ur5", sign_of_joint_4, "column j4_deg has its sign turned: multiply it by -1"),
        ("ur5", metres, "x_mm, y_mm, z_mm are in metres: multiply by 1000"),
        (
            "ur5",
            one_reading_lost,
            "from line 702 on the measurements belong to the joints 1 row later: "
            "move the measurements down by 1 row",
        ),
        ("ipa_ur10_b", sign_of_joint_4, "column j4_deg has its sign turned: multiply it by -1"),
        (
            "ipa_ur10_b",
            scalar_last,
            "qw, qx, qy, qz hold x, y, z, w: move qz to the front",
        ),
        ("ipa_ur10_a", metres, "x_mm, y_mm, z_mm are in metres: multiply by 1000"),
    ],
    ids=lambda value: getattr(value, "__name__", None),
)
def test_slips_of_real_campaigns_are_named(tmp_path, name, change, sentence):
    folder = respelled(real(name), tmp_path / "spoiled", change)
    assert [slip.report() for slip in find_slips(read_bundle(folder))] == [sentence]


PAIRS = (
    (spoiled.joint_sign, spoiled.positions_in_another_unit),
    (spoiled.joint_sign, spoiled.rows_shifted),
    (spoiled.radians, spoiled.joint_sign),
    (spoiled.zero_of_a_joint, spoiled.an_axis_turned),
    (spoiled.coupled_joints, spoiled.passive_orientation),
    (spoiled.rows_shifted, spoiled.quaternion_last_first),
)


@pytest.mark.parametrize("kinds", PAIRS, ids=lambda kinds: "_and_".join(k.__name__ for k in kinds))
def test_two_slips_at_once_are_both_named(tmp_path, kinds):
    table = Campaign("ur5e", seed=5, rows=60, outliers=0.02).measure()
    rng = np.random.default_rng(1)
    first: Spoiled = kinds[0](table, rng)
    second: Spoiled = kinds[1](first.table, rng)
    table.write(tmp_path / "sound", "ur5e")
    slips = find(tmp_path / "spoiled", second.table, "ur5e")
    assert sorted(slip.fault for slip in slips) == sorted([first.fault, second.fault])
    mended = mend(read_bundle(tmp_path / "spoiled"), slips)
    assert gives_back(mended, read_bundle(tmp_path / "sound"), exact=True)


def test_data_of_another_robot_get_no_name(tmp_path):
    table = Campaign("ur10e", seed=1).measure()
    with pytest.raises(NoAnswer, match="do not fit robot 'staubli-tx60'"):
        find(tmp_path, table, "staubli_tx60")


def test_rows_in_no_order_get_no_name(tmp_path):
    table = Campaign("ur10e", seed=1, full_pose=False).measure()
    table = table.measured_at(np.random.default_rng(1).permutation(len(table)))
    with pytest.raises(NoAnswer, match="do not fit"):
        find(tmp_path, table, "ur10e")


def test_orientations_of_something_else_get_no_name(tmp_path):
    table = Campaign("ur10e", seed=1).measure()
    order = np.random.default_rng(1).permutation(len(table))
    with pytest.raises(NoAnswer, match="the orientations qw, qx, qy, qz do not"):
        find(tmp_path, replace(table, quaternion=table.quaternion[order]), "ur10e")


def test_what_base_and_tool_absorb_is_no_fault(tmp_path):
    """The zeros of the first and the last joint; coordinates moved on, which is a turn."""
    table = Campaign("ur10e", seed=2).measure()
    zeros = replace(table, joints=table.joints + np.array([90, 0, 0, 0, 0, -90]))
    assert find(tmp_path / "zeros", zeros, "ur10e") == ()
    turned = replace(table, position=table.position[:, [1, 2, 0]], quaternion=None)
    assert find(tmp_path / "turned", turned, "ur10e") == ()


def test_a_sign_that_only_the_orientations_see_is_named(tmp_path):
    """Target on axis 6: its place does not move with joint 6."""
    table = Campaign("staubli_tx60", seed=3).measure()
    T = table.arm.poses(table.joints * table.arm.units())
    quaternion = spoiled.wxyz(Rotation.from_matrix(T[:, :3, :3]))
    table = replace(table, position=T[:, :3, 3] * 1e3, quaternion=quaternion)
    joints = table.joints * [1, 1, 1, 1, 1, -1]
    slips = find(tmp_path, replace(table, joints=joints), "staubli_tx60")
    assert [slip.columns for slip in slips] == [("j6_deg",)]
    assert find(tmp_path, replace(table, joints=joints, quaternion=None), "staubli_tx60") == ()


def test_equal_mends_are_both_said_and_none_is_chosen(tmp_path):
    """A SCARA upside down is a SCARA in a left-handed frame."""
    table = Campaign("abb_irb910sc", seed=2, full_pose=False).measure()
    turned = replace(table, position=table.position * [1, -1, 1])
    (slip,) = find(tmp_path, turned, "abb_irb910sc")
    assert "which these data cannot tell apart" in slip.report()
    with pytest.raises(NoAnswer, match="by hand"):
        mend(read_bundle(tmp_path), (slip,))


def test_several_targets_are_no_outliers_of_each_other(tmp_path):
    campaign = Campaign("ur10e", seed=6, rows=75, full_pose=False, targets=("a", "b", "c"))
    table = campaign.measure()
    assert find(tmp_path / "sound", table, "ur10e") == ()
    fault = spoiled.joint_sign(table, np.random.default_rng(1))
    (slip,) = find(tmp_path / "spoiled", fault.table, "ur10e")
    assert (slip.fault, slip.columns) == (Fault.joint_sign, fault.columns)


def test_measurements_whose_joints_are_not_in_the_file_are_rejected_by_line(tmp_path):
    """From row 20 on the joints come five rows later: the last five measurements lose theirs."""
    table = Campaign("ur10e", seed=1, rows=40).measure()
    source = np.array([*range(20), *range(25, 40)])
    table = replace(table.measured_at(source), joints=table.joints[:35])
    (slip,) = find(tmp_path, table, "ur10e")
    assert slip.lines == tuple(range(22, 37))
    mended = mend(read_bundle(tmp_path), (slip,))
    assert [row.line for row in mended.rejected] == [32, 33, 34, 35, 36]
    assert all("row shift" in row.reason for row in mended.rejected)

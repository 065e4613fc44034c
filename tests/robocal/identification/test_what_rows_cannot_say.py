"""Data that leave something open: it is said, and the uncertainty covers it."""

from dataclasses import replace

import numpy as np
import pytest

from robocal.calibrated import CalibratedRobot, Provenance
from robocal.errors import BadInput
from robocal.formats.bundle import Target, read_bundle
from robocal.formats.identification_json import identification_document
from robocal.frames import xyz_ypr_from_frame
from robocal.identification.identify import identify
from robocal.identification.priors import Choices, choices_of
from robocal.identification.result import Status
from robocal.identification.station_drift import find_drift
from robocal.kinematics.forward import forward_kinematics
from tests.measured_cell import measure, true_cell, write_bundle
from tests.robocal.identification.cells import measured


def still_joint_bundle(folder, joint: int):
    """40 full poses of a TX60 whose one joint never moved."""
    bundle, cell, _ = measured(folder, "staubli_tx60", 3, 40, full_pose=True)
    joints = bundle.measurements.joints.copy()
    joints[:, joint] = 0.3
    position, orientation = measure(cell.true, joints, np.random.default_rng(1))
    rows = replace(bundle.measurements, joints=joints, position=position, orientation=orientation)
    return replace(bundle, measurements=rows), cell


@pytest.mark.parametrize("joint", [0, 5])
def test_a_joint_that_never_moved_widens_the_uncertainty_where_it_does_move(tmp_path, joint):
    bundle, cell = still_joint_bundle(tmp_path, joint)
    result = identify(bundle)
    robot = CalibratedRobot(
        bundle.robot,
        result.model,
        result.full_covariance(),
        bundle.gravity,
        Provenance("", "", "", ""),
    )
    q = cell.nominal.draw(np.random.default_rng(5), 60, widest=2.0)
    miss = np.linalg.norm(robot.tool_poses(q)[:, :3, 3] - cell.true.poses(q)[:, :3, 3], axis=1)
    stated = np.sqrt(np.einsum("mii->m", robot.tool_position_covariance(q)))
    assert miss.mean() > 1e-4  # the still joint's neighbours are really unknown
    assert np.mean(miss < 2.5 * stated) >= 0.9


def test_one_pose_again_and_again_is_too_few_poses(tmp_path):
    bundle, _, _ = measured(tmp_path, "ur5e", 3, 40, full_pose=True)
    same = replace(
        bundle.measurements, joints=np.repeat(bundle.measurements.joints[:1], 40, axis=0)
    )
    with pytest.raises(BadInput, match="1 different poses"):
        identify(replace(bundle, measurements=same))


def test_a_fixed_base_stands_where_the_campaign_says(tmp_path):
    bundle, cell, _ = measured(tmp_path, "ur5e", 4, 50, full_pose=True)
    everything = [f"base_{name}" for name in ("x", "y", "z", "yaw", "pitch", "roll")]
    fixed = choices_of(everything, [], [])
    with pytest.raises(BadInput, match="base_guess"):
        identify(bundle, choices=fixed)
    true = cell.true.base
    guess = np.array([
        *true[:3, 3],
        np.arctan2(true[1, 0], true[0, 0]),
        np.arcsin(-true[2, 0]),
        np.arctan2(true[2, 1], true[2, 2]),
    ])
    result = identify(replace(bundle, base_guess=guess), choices=fixed)
    assert result.base == pytest.approx(true, abs=1e-9)
    assert result.adequacy.adequate


def test_repeats_of_a_pose_share_its_number_without_being_told(tmp_path):
    write_bundle(tmp_path, "ur5e", true_cell("ur5e", 1), rows=20)
    table = tmp_path / "measurements.csv"
    header, *rows = table.read_text().splitlines()
    table.write_text("\n".join([header, *rows, *rows]) + "\n")
    pose = read_bundle(tmp_path).measurements.pose
    assert (pose[:20] == pose[20:]).all()
    assert len(np.unique(pose)) == 20


@pytest.mark.parametrize("value", ["nan", "inf", "0", "1e-300", "-1"])
def test_a_prior_must_be_a_positive_number_of_sensible_size(value):
    with pytest.raises(BadInput, match="positive"):
        choices_of([], [], [f"a_2_mm={value}"])


@pytest.mark.parametrize(
    ("prior", "complaint"),
    [
        ("a_2_mm", "its value is missing, NAME=VALUE is wanted"),
        ("a_2_mm=", "its value is missing, NAME=VALUE is wanted"),
        ("a_2_mm=wide", "'wide' is no number, NAME=VALUE is wanted"),
    ],
)
def test_a_prior_without_a_number_is_told_what_to_write(prior, complaint):
    with pytest.raises(BadInput, match=f"prior '{prior}': must look like a_2_mm=0.2: {complaint}"):
        choices_of([], [], [prior])


def test_two_priors_of_one_parameter_are_refused():
    with pytest.raises(BadInput, match="is the second one of a_2"):
        choices_of([], [], ["a_2_mm=1", "a_2_mm=2"])


@pytest.mark.parametrize("prior", ["theta_2_mm=1", "d_2_deg=1", "tool_yaw_mm=1", "base_x_deg=1"])
def test_a_prior_in_a_unit_that_its_parameter_has_not_is_refused(prior):
    with pytest.raises(BadInput, match="so it must end in _"):
        choices_of([], [], [prior])


def test_a_still_station_seldom_looks_as_if_it_drifted(tmp_path):
    bundle, _, _ = measured(tmp_path, "ur5e", 6, 30, full_pose=False)
    nest = np.array([2.0, 0.5, 0.1])
    found = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        std = bundle.instrument.position_std(nest[None])[0]
        position = np.where(
            np.arange(30)[:, None] % 2 == 0,
            nest + rng.normal(size=(30, 3)) * std,
            bundle.measurements.position,
        )
        fixed = np.arange(30) % 2 == 0
        rows = replace(
            bundle.measurements,
            position=position,
            target=tuple("r1" if nested else "" for nested in fixed),
        )
        visited = replace(bundle, measurements=rows, targets={"r1": Target(None, fixed=True)})
        drift = find_drift(visited.measurements, fixed, visited.instrument)
        found += drift.significant
    # One in a hundred by construction; more than seven of 200 has probability 0.001.
    assert found <= 7


def test_choices_of_a_campaign_are_overruled_by_later_ones():
    first = Choices(fixed=frozenset({"a_2"}), prior_std={"a_3": 1e-4})
    both = first.overruled_by(choices_of([], ["a_2"], ["a_3_mm=1"]))
    assert both.fixed == frozenset()
    assert both.free == frozenset({"a_2"})
    assert both.prior_std == {"a_3": pytest.approx(1e-3)}


@pytest.mark.parametrize("asked", ["d_2", "beta_5", "theta_1"])
def test_a_redundant_parameter_is_identified_when_it_is_asked_for(tmp_path, asked):
    """Another one that moves the target alike gives way, and the poses stay what they are."""
    bundle, cell, _ = measured(tmp_path, "ur10e", 4, 60, full_pose=True)
    plain = identify(bundle)
    result = identify(bundle, choices=choices_of([], [asked], []))
    assert (plain.status(asked), result.status(asked)) == (Status.redundant, Status.identified)
    assert result.std[result.cell.names.index(asked)] > 0
    assert result.rank == plain.rank
    assert not result.unmet
    q = cell.nominal.draw(np.random.default_rng(0), 100, widest=2.0)
    np.testing.assert_allclose(
        forward_kinematics(result.model, q), forward_kinematics(plain.model, q), atol=2e-5
    )


def test_of_two_parameters_asked_for_that_move_the_tool_alike_one_is_named_as_not_met(tmp_path):
    bundle, _, _ = measured(tmp_path, "ur10e", 4, 60, full_pose=True)
    everything = ["d_2", "d_3", "d_4"]
    result = identify(bundle, choices=choices_of([], everything, []))
    assert len(result.unmet) == 2
    document = identification_document(result)
    assert document["choices"]["not_met"] == result.unmet
    for name, reason in result.unmet.items():
        (row,) = [row for row in document["parameters"] if row["name"] == name]
        assert row["status"] == "redundant"
        assert row["reason"] == f"asked for, but not identified: {reason}"
        assert any(other in reason for other in everything)


def test_the_command_line_says_which_wish_it_could_not_meet(tmp_path, call):
    write_bundle(tmp_path / "b", "ur10e", true_cell("ur10e", 4), rows=60)
    asked = ("--free", "d_2", "--free", "d_3", "--prior", "beta_6_deg=0.1")
    status, printed, _ = call("identify", tmp_path / "b", "--out", tmp_path, *asked)
    assert status == 0
    assert "d_3 was asked for, but is not identified: parallel to d_2" in printed
    assert "beta_6 was asked for, but is not identified: moves the target as" in printed


FRAMES = [
    f"{frame}_{name}"
    for frame in ("base", "tool")
    for name in ("x", "y", "z", "yaw", "pitch", "roll")
]
LINKS = [
    f"{name}_{joint}" for name in ("theta", "d", "a", "alpha", "beta") for joint in range(1, 7)
]


def with_guesses(folder):
    """A bundle whose campaign states where base and tool are, and a robot that is nominal."""
    cell = true_cell("ur5e", 4, wrong=())
    write_bundle(folder, "ur5e", cell, rows=40)
    guesses = {
        "base_guess": xyz_ypr_from_frame(cell.true.base),
        "tool_guess": xyz_ypr_from_frame(cell.true.tool),
    }
    return replace(read_bundle(folder), **guesses)


def test_links_are_identified_where_base_and_tool_are_both_fixed(tmp_path, identified):
    result = identified(with_guesses(tmp_path), choices=choices_of(FRAMES, [], []))
    assert result.adequacy.adequate
    assert len(result.free)


def test_where_no_parameter_is_left_free_it_is_said(tmp_path, identified):
    everything = choices_of([*FRAMES, *LINKS], [], [])
    with pytest.raises(BadInput, match="leaves no parameter to identify: each is fixed"):
        identified(with_guesses(tmp_path), choices=everything)


@pytest.mark.parametrize("command", ["identify", "diagnose", "uncertainty"])
def test_noise_that_hides_every_parameter_is_refused(tmp_path, call, command):
    write_bundle(tmp_path / "b", "ur5e", true_cell("ur5e", 4), rows=40, full_pose=False)
    campaign = tmp_path / "b" / "campaign.yaml"
    campaign.write_text(campaign.read_text().replace("sigma_mm: 0.015", "sigma_mm: 1.0e+7"))
    status, _, said = call(command, tmp_path / "b", "--out", tmp_path / "out")
    assert status == 2
    assert "leaves no parameter to identify" in said

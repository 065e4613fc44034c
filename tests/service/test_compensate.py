"""Poses in, joints out; where the joints really lead an independent program says."""

import numpy as np
import pytest

from robocal.frames import quaternion_from_rotation
from service.parameters import store
from tests.robocal.formats.calibrated_arms import calibrated_arm
from tests.service.released_arm import WHY, content_of


@pytest.fixture
def arm():
    return calibrated_arm("ur10e")


@pytest.fixture
def released(client, cell, database, arm):
    """Version 1 of cell c1, released."""
    client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": 8})
    with database.write() as session:
        store.add_candidate(session, "c1", 1, content_of(arm))
    assert client.post("cells/c1/parameters/1/release", json=WHY).status_code == 200


def poses(T: np.ndarray) -> list[dict]:
    quaternions = quaternion_from_rotation(T[:, :3, :3])
    return [
        {"xyz_mm": [1e3 * float(v) for v in pose[:3, 3]], "quaternion": quaternion.tolist()}
        for pose, quaternion in zip(T, quaternions, strict=True)
    ]


def spread(count: int) -> np.ndarray:
    """Joints about an ordinary pose, away from singular ones [rad]."""
    middle = np.deg2rad([20, -80, 95, -100, -85, 10])
    return middle + np.random.default_rng(4).uniform(-0.3, 0.3, (count, 6))


def test_the_true_robot_is_at_the_wanted_poses_with_the_joints_given(client, released, arm):
    wanted = arm.true.poses(spread(40))
    answer = client.post("cells/c1/compensate", json={"poses": poses(wanted)})
    assert answer.status_code == 200
    found = answer.json()
    assert (found["cell"], found["version"], found["reached"]) == ("c1", 1, 40)
    assert found["columns"] == [f"j{joint}_deg" for joint in range(1, 7)]
    assert (found["missed"], found["joints"]) == ([], None)
    there = arm.true.poses(np.deg2rad(found["joints_deg"]))
    assert np.abs(there - wanted).max() < 1e-6


def test_given_nominal_joints_keep_their_configuration(client, released, arm):
    q = spread(5)
    body = {
        "poses": [
            pose | {"nominal_joints": {f"j{k + 1}_deg": float(v) for k, v in enumerate(row)}}
            for pose, row in zip(poses(arm.true.poses(q)), np.rad2deg(q), strict=True)
        ]
    }
    found = client.post("cells/c1/compensate", json=body).json()
    assert np.deg2rad(found["joints_deg"]) == pytest.approx(q, abs=1e-6)


def test_poses_in_the_base_frame_are_turned_into_the_cell(client, released, arm):
    in_cell = arm.true.poses(spread(3))
    in_base = np.linalg.inv(arm.calibrated.model.base_frame) @ in_cell
    body = {"poses": poses(in_base), "frame": "base"}
    found = client.post("cells/c1/compensate", json=body).json()
    assert np.abs(arm.true.poses(np.deg2rad(found["joints_deg"])) - in_cell).max() < 1e-6


def test_a_pose_out_of_reach_is_named_and_the_others_get_their_joints(client, released, arm):
    wanted = arm.true.poses(spread(3))
    wanted[1, :3, 3] += 10.0
    found = client.post("cells/c1/compensate", json={"poses": poses(wanted)}).json()
    assert found["reached"] == 2
    assert found["joints_deg"][1] is None
    assert found["joints_deg"][0] is not None
    (missed,) = found["missed"]
    assert (missed["pose"], missed["status"]) == (1, "not_reached")
    assert "Pose 1" in missed["detail"]


def test_joints_outside_the_limits_are_named_not_clipped(client, database, cell):
    limited = calibrated_arm("abb_irb120")
    client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": 8})
    with database.write() as session:
        store.add_candidate(session, "c1", 1, content_of(limited))
    middle = np.deg2rad([10, 20, -20, 30, 40, 10])
    beyond = limited.calibrated.robot.limits[1, 1] + 0.05
    q = np.vstack([middle, np.where(np.arange(6) == 1, beyond, middle)])
    body = {
        "poses": [
            pose | {"nominal_joints": {f"j{k + 1}_deg": float(v) for k, v in enumerate(row)}}
            for pose, row in zip(poses(limited.true.poses(q)), np.rad2deg(q), strict=True)
        ]
    }
    found = client.post("cells/c1/compensate?version=1", json=body).json()
    assert [missed["status"] for missed in found["missed"]] == ["outside_limits"]
    assert found["joints_deg"][1] is None


def test_only_released_parameters_are_used_unless_a_version_is_named(client, cell, database, arm):
    client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": 8})
    with database.write() as session:
        store.add_candidate(session, "c1", 1, content_of(arm))
    body = {"poses": poses(arm.true.poses(spread(1)))}
    refused = client.post("cells/c1/compensate", json=body)
    assert refused.status_code == 404
    assert "version 1 is a candidate" in refused.json()["detail"]
    assert client.post("cells/c1/compensate?version=1", json=body).json()["version"] == 1


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"poses": []}, "poses"),
        ({"poses": [{"xyz_mm": [0, 0, 0], "quaternion": [2, 0, 0, 0]}]}, "poses.0.quaternion"),
        ({"poses": [{"xyz_mm": [0, 0], "quaternion": [1, 0, 0, 0]}]}, "poses.0.xyz_mm"),
        (
            {
                "poses": [
                    {"xyz_mm": [0, 0, 1], "quaternion": [1, 0, 0, 0], "nominal_joints": {"j1": 0}}
                ]
            },
            "poses.0.nominal_joints",
        ),
        ({"frame": "moon"}, "frame"),
    ],
)
def test_a_wrong_field_is_named(client, released, change, words):
    body = {"poses": [{"xyz_mm": [500, 0, 500], "quaternion": [1, 0, 0, 0]}]} | change
    answer = client.post("cells/c1/compensate", json=body)
    assert answer.status_code == 422
    assert words in answer.json()["detail"]

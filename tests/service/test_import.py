"""Bundles that come by HTTP: what is wrong with them is said in one sentence, nothing is stored."""

import io
import zipfile

import pytest

from robocal.robots.library import robot_path

HEADER = "j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm"
ROW = "1,2,3,4,5,6,700,800,900"
ROWS = "\n".join(f"{k},2,3,4,5,{k},700,800,900" for k in range(13)) + "\n"
"""Enough different poses for the parameters of six joints from positions."""
CAMPAIGN = "robot: robot.yaml\ninstrument: {kind: laser_tracker, sigma_mm: 0.015}\n"


@pytest.fixture
def robot_yaml() -> str:
    return robot_path("ur10e").read_text(encoding="utf-8")


def bundle(robot: str, csv: str, campaign: str = CAMPAIGN) -> bytes:
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as packed:
        packed.writestr("robot.yaml", robot)
        packed.writestr("campaign.yaml", campaign)
        packed.writestr("measurements.csv", csv)
    return target.getvalue()


def send(client, content: bytes, **options):
    headers = {"Content-Type": "application/zip"} | options.pop("headers", {})
    return client.post("campaigns/import", content=content, headers=headers, **options)


def test_a_good_bundle_becomes_a_queued_campaign_with_its_own_rows(client, robot_yaml):
    content = bundle(robot_yaml, f"{HEADER}\n{ROWS}")
    answer = send(client, content)
    assert answer.status_code == 202
    assert answer.json() == {"id": 1, "state": "queued"}
    shown = client.get("campaigns/1").json()
    assert (shown["cell"], shown["done"], shown["total"]) == (None, 13, 13)
    text = client.get("campaigns/1/measurements", headers={"Accept": "text/csv"}).text
    assert text == f"{HEADER}\n{ROWS}"
    rows = client.get("campaigns/1/measurements").json()["rows"]
    assert rows[0]["z_mm"] == 900
    with zipfile.ZipFile(io.BytesIO(client.get("campaigns/1/bundle").content)) as back:
        assert back.read("robot.yaml").decode() == robot_yaml


def test_a_form_with_a_file_is_taken_too(client, robot_yaml):
    content = bundle(robot_yaml, f"{HEADER}\n{ROWS}")
    answer = client.post("campaigns/import", files={"bundle": ("b.zip", content)})
    assert answer.status_code == 202


def test_the_same_key_imports_once(client, robot_yaml):
    content = bundle(robot_yaml, f"{HEADER}\n{ROWS}")
    headers = {"Idempotency-Key": "upload-1"}
    first, second = (send(client, content, headers=headers) for _ in range(2))
    assert first.content == second.content
    other = send(client, content + b" ", headers=headers)
    assert other.status_code == 422
    assert len(client.get("campaigns").json()["campaigns"]) == 1


@pytest.mark.parametrize(
    ("csv", "words"),
    [
        ("", "measurements.csv"),
        (f"{HEADER}\n", "measurements.csv"),
        (f"{HEADER}\n1,2,3,4,5,6,700,here,900\n", "measurements.csv line 2"),
        (f"{HEADER}\n{ROW}\n1,2,nan,4,5,6,7,8,9\n", "measurements.csv line 3"),
        (f"{HEADER},x_mm\n{ROW},7\n", "x_mm"),
        ("j1_deg,x_mm,y_mm,z_mm\n1,2,3,4\n", "j2_deg"),
        (f"{HEADER},j7_deg\n{ROW},1\n", "j7_deg"),
        (f"{HEADER}\n{ROW}\n0,0,0,0,0,0,7,8,9\n9,9,9,9,9,9,1,2,3\n", "27 parameters"),
    ],
)
def test_a_bad_row_is_named_by_its_line_and_nothing_is_stored(client, robot_yaml, csv, words):
    answer = send(client, bundle(robot_yaml, csv))
    assert answer.status_code == 422
    detail = answer.json()["detail"]
    assert words in detail
    assert "\n" not in detail
    assert "/tmp" not in detail
    assert client.get("campaigns").json()["campaigns"] == []


def test_broken_yaml_is_named(client, robot_yaml):
    for robot, campaign, file in (
        ("name: [", CAMPAIGN, "robot.yaml"),
        (robot_yaml, "robot: robot.yaml\ninstrument: {", "campaign.yaml"),
        (robot_yaml, "robot: ../robot.yaml\n", "campaign.yaml"),
    ):
        answer = send(client, bundle(robot, f"{HEADER}\n{ROW}\n", campaign))
        assert answer.status_code == 422
        assert file in answer.json()["detail"]
        assert "\n" not in answer.json()["detail"]


def test_what_is_no_zip_is_refused(client):
    answer = send(client, b"hello")
    assert answer.status_code == 422
    assert "not a readable .zip" in answer.json()["detail"]


def test_a_form_without_a_file_is_refused(client):
    answer = client.post("campaigns/import", data={"a": "b"}, files={})
    assert answer.status_code == 422


def test_a_bundle_for_another_kind_of_robot_does_not_enter_a_cell(client, cell):
    scara = robot_path("abb_irb910sc").read_text(encoding="utf-8")
    header = _header_of(scara)
    answer = send(client, bundle(scara, header), params={"cell": "c1"})
    assert answer.status_code == 422
    assert "4 joints" in answer.json()["detail"]
    assert send(client, bundle(scara, header), params={"cell": "no"}).status_code == 404


def _header_of(robot: str) -> str:
    """Rows for a robot, by the types that its file lists."""
    types = [line for line in robot.splitlines() if "type:" in line]
    units = ["mm" if "prismatic" in line else "deg" for line in types]
    names = [f"j{joint}_{unit}" for joint, unit in enumerate(units, start=1)]
    columns = [*names, "x_mm", "y_mm", "z_mm"]
    rows = [",".join(str(k) for _ in columns) for k in range(13)]
    return "\n".join([",".join(columns), *rows]) + "\n"

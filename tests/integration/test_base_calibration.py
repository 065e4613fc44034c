"""The touch procedure through the service: real drivers, an emulated stage, a person's hands."""

import json
import math
import zipfile
from contextlib import closing
from io import BytesIO

import numpy as np
import pytest
from service_cell import Site, installation, wait_until
from stage_hands import frame, placed

from service.emulated_stage import SLAVE_BASE, EmulatedStage, StageAddresses, StageHands

MANY = [
    ("master", "rod", 0, 0, 350),
    ("master", "slide", 0, 0, 350),
    ("master", "rod", 0, -50, 250),
    ("master", "rod", 300, 40, 440),
    ("master", "slide", 300, 40, 440),
    ("slave", "rod", 1500, -30, 260),
    ("slave", "rod", 1500, 30, 440),
    ("slave", "slide", 1500, 30, 440),
    ("slave", "rod", 1250, 40, 300),
    ("slave", "rod", 1250, -40, 260),
]


@pytest.fixture(scope="module")
def stage():
    with EmulatedStage(3) as addresses:
        yield addresses


@pytest.fixture(scope="module")
def hands(stage):
    with closing(StageHands(stage.stage_world)) as opened:
        yield opened


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    with installation(tmp_path_factory.mktemp("site"), workers=0) as running:
        yield running


def start(site: Site, stage: StageAddresses, name: str) -> int:
    answer = site.post("/base-calibrations", stage.request(name))
    assert answer.status_code == 201, answer.text
    return answer.json()["id"]


def take(site: Site, number: int, robot: str, cup: str) -> dict:
    body = {"robot": robot, "cup": cup}
    answer = site.post(f"/base-calibrations/{number}/touches", body)
    assert answer.status_code == 201, answer.text
    return answer.json()


def touch(site: Site, hands: StageHands, number: int, row: tuple, **more: object) -> dict:
    robot, cup, slide, angle, length = row
    about = {"slide_mm": slide, "rod_angle_deg": angle, "rod_length_mm": length, **more}
    assert hands.touch(robot, cup, **about)["ok"]
    return take(site, number, robot, cup)


def shown(site: Site, number: int) -> dict:
    answer = site.get(f"/base-calibrations/{number}")
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_the_guided_touches_of_two_robots_end_in_a_released_transform(site, stage, hands):
    number = start(site, stage, "line-1")
    steps = []
    for _ in range(7):
        found = shown(site, number)
        wanted = found["next_touch"]
        assert wanted, found["no_answer"]
        steps.append((wanted["step"], wanted["robot"], wanted["cup"]))
        assert hands.touch(wanted["robot"], wanted["cup"], **placed(wanted))["ok"]
        take(site, number, wanted["robot"], wanted["cup"])
    assert steps[:4] == [
        ("P1", "master", "rod"),
        ("P2", "master", "slide"),
        ("R1", "slave", "rod"),
        ("R2", "slave", "rod"),
    ]
    assert {step for step, _, _ in steps[4:]} == {"best"}
    site.service.kill()
    site.start_service()
    after = shown(site, number)
    assert len(after["touches"]) == 7
    assert after["assessment"]["undetermined"] == []
    finished = site.post(f"/base-calibrations/{number}/finish").json()
    assert finished == {"id": number, "name": "line-1", "version": 1}
    require_truth(site.get(f"/base-calibrations/{number}/result").json())
    assert site.get("/base-transforms/line-1").status_code == 404
    released = site.post("/base-transforms/line-1/1/release").json()
    assert released["state"] == "released"
    assert site.get("/base-transforms/line-1").json() == released


def require_truth(result: dict) -> None:
    """Within four standard uncertainties of where the slave truly stands."""
    off = np.array(result["transform"]["xyz_mm"]) - SLAVE_BASE["xyz_mm"]
    assert np.all(np.abs(off) < 4 * np.array(result["std"][:3])), (off, result["std"])
    assert max(result["std"][:3]) < 0.5
    R = np.array(result["transform"]["matrix"])[:3, :3]
    turn = math.acos(min((np.trace(R.T @ frame(SLAVE_BASE)[:3, :3]) - 1) / 2, 1.0))
    assert math.degrees(turn) < 4 * np.linalg.norm(result["std"][3:])


def test_a_slipped_touch_is_named_and_voided_and_the_command_computes_the_same(
    site, stage, hands, call, tmp_path
):
    number = start(site, stage, "line-2")
    for row in MANY[:-1]:
        touch(site, hands, number, row)
    slipped = touch(site, hands, number, MANY[-1], slip_mm=[0, 1.5, 0])["number"]
    faults = shown(site, number)["assessment"]["faults"]
    assert [(fault["fault"], fault["touches"]) for fault in faults] == [
        ("slipped_touch", [slipped])
    ]
    why = {"reason": "the needle slipped off the cup's rim"}
    voided = site.post(f"/base-calibrations/{number}/touches/{slipped}/void", why).json()
    assert voided["void_reason"] == why["reason"]
    touch(site, hands, number, MANY[-1])
    cleared = shown(site, number)
    assert cleared["assessment"]["faults"] == []
    assert [entry["number"] for entry in cleared["touches"] if entry["voided"]] == [slipped]
    assert site.post(f"/base-calibrations/{number}/finish").status_code == 200
    result = site.get(f"/base-calibrations/{number}/result").json()
    require_truth(result)
    packed = site.get(f"/base-calibrations/{number}/bundle").content
    zipfile.ZipFile(BytesIO(packed)).extractall(tmp_path)
    status, printed, _ = call("basecal", tmp_path / "stage.yaml", "--out", tmp_path, "--json")
    again = json.loads(printed)
    assert status == 0
    assert again["transform"]["xyz_mm"] == pytest.approx(result["transform"]["xyz_mm"], abs=1e-9)
    assert again["monte_carlo"] == result["monte_carlo"]


def test_a_stage_that_wavers_is_refused_with_the_sensor_and_its_spread(site, stage, hands):
    number = start(site, stage, "line-3")
    hands.touch("master", "rod", slide_mm=0, rod_angle_deg=0, rod_length_mm=350)
    hands.ask("shake", sensor="rod_length", amplitude=2e-3)
    body = {"robot": "master", "cup": "rod"}
    refused = site.post(f"/base-calibrations/{number}/touches", body)
    hands.ask("shake", sensor="rod_length", amplitude=0.0)
    assert refused.status_code == 409
    assert "sensor 'rod_length' wavers by" in refused.json()["detail"]
    assert shown(site, number)["touches"] == []
    take(site, number, "master", "rod")


def test_the_sensors_are_seen_live_and_a_missing_one_says_why(site, stage):
    request = stage.request("line-4")
    request["stage"]["sensors"]["slide"]["address"] = "/dev/ttyS-none"
    number = site.post("/base-calibrations", request).json()["id"]

    def views() -> dict[str, dict]:
        found = site.get(f"/base-calibrations/{number}/sensors").json()["sensors"]
        return {view["sensor"]: view for view in found}

    wait_until(lambda: views()["rod_length"]["steady"] and views()["slide"]["problem"] != "")
    seen = views()
    assert seen["rod_length"]["unit"] == "mm"
    assert seen["rod_length"]["spread"] < seen["rod_length"]["allowed_spread"]
    assert not seen["slide"]["steady"]
    assert "/dev/ttyS-none" in seen["slide"]["problem"]

"""Health checks through HTTP: the emulated world moves things, the service says which."""

import json

import pytest
from service_cell import ENDED, emulated_world, installation, wait_until

from tests.service.released_arm import WHY
from tests.service.webhook_receiver import receiver

BASE_STEP = {"effect": "base_step", "step_mm": [0.6, -0.5, 0.3], "turn_mrad": [0.2, 0, 0.3]}
TOOL_STEP = {"effect": "tool_step", "step_mm": [0.5, 0.4, -0.3]}
ENCODER_STEP = {"effect": "encoder_step", "joint": 3, "step_mrad": 1.0}


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    with emulated_world(tmp_path_factory.mktemp("world")) as running:
        yield running


@pytest.fixture(scope="module")
def site(tmp_path_factory, world):
    """An installation whose cell is calibrated and released."""
    folder = tmp_path_factory.mktemp("site")
    with installation(folder, webhook_networks='["127.0.0.0/8"]') as running:
        running.make_cell(world)
        number = running.start_campaign(30)
        version = "/cells/c1/parameters?version=1"
        wait_until(lambda: running.get(version).status_code == 200, period_s=0.1)
        # The diagnosis that would follow is of no use here.
        running.post(f"/campaigns/{number}/abort")
        running.await_state(number, *ENDED)
        assert running.post("/cells/c1/parameters/1/release", WHY).status_code == 200
        yield running


def check(site, world, *effects: dict) -> dict:
    """The answer of a health check while these effects act."""
    world.ask("set", name="effects", value=[effect | {"at_s": 0} for effect in effects])
    site.post("/cells/c1/arm")
    number = site.start_campaign(8, kind="health")
    shown = site.await_state(number, *ENDED, "paused")
    assert shown["state"] == "finished", shown
    assert shown["parameters_version"] == 1
    return site.get(f"/campaigns/{number}/health").json()


def test_a_cell_that_did_not_change_is_healthy(site, world):
    found = check(site, world)
    assert (found["alarm"], found["moved"], found["full_campaign_needed"]) == (False, None, False)
    assert found["degrees_of_freedom"] == 24
    assert found["chi_square"] < found["chi_square_limit"]
    assert found["alternatives"] == []


@pytest.mark.parametrize(
    ("effect", "moved", "full"),
    [(BASE_STEP, "base", False), (TOOL_STEP, "tool", False), (ENCODER_STEP, "joint_3", True)],
    ids=["base", "tool", "joint"],
)
def test_what_moved_is_named_with_what_to_do(site, world, effect, moved, full):
    found = check(site, world, effect)
    assert found["alarm"] is True
    assert (found["moved"], found["full_campaign_needed"]) == (moved, full)
    assert found["advice"]
    first = found["alternatives"][0]
    assert first["probability"] > 0.9
    if moved == "joint_3":
        zero = first["numbers"]["zero_mrad"]
        assert abs(zero["value"]) == pytest.approx(1.0, abs=5 * zero["std"])


def test_an_arm_that_grew_warm_is_named(site, world):
    world.ask("set", name="temperature_degc", value=50.0)
    world.ask("set", name="effects", value=[{"effect": "thermal_expansion"}])
    site.post("/cells/c1/arm")
    number = site.start_campaign(8, kind="health")
    assert site.await_state(number, *ENDED, "paused", within_s=150)["state"] == "finished"
    world.ask("set", name="temperature_degc", value=None)
    found = site.get(f"/campaigns/{number}/health").json()
    assert (found["alarm"], found["moved"]) == (True, "temperature")
    growth = found["alternatives"][0]["numbers"]["growth_ppm"]
    assert growth["value"] == pytest.approx(30 * 23, abs=max(5 * growth["std"], 70))


def test_the_alarm_is_announced_and_the_trend_is_there_for_the_chart(site, world):
    with receiver(503, 204) as heard:
        body = {"url": heard.url, "events": ["drift.alarm"]}
        hook = site.post("/webhooks", body).json()
        check(site, world, BASE_STEP)
        site.client.timeout = 30
        log = f"/webhooks/{hook['id']}/deliveries"
        wait_until(lambda: len(heard.requests) >= 1)
        site.post(f"/webhooks/{hook['id']}/remove")
    content = json.loads(heard.requests[0][1])
    assert (content["event"], content["moved"], content["version"]) == ("drift.alarm", "base", 1)
    assert site.get(log).status_code == 404
    series = site.get("/cells/c1/health").json()["checks"]
    assert [point["campaign"] for point in series] == sorted(
        (point["campaign"] for point in series), reverse=True
    )
    newest = series[0]
    assert (newest["campaign"], newest["moved"]) == (content["campaign"]["id"], "base")
    assert newest["chi_square"] > newest["chi_square_limit"]


def test_without_released_parameters_there_is_nothing_to_check(site, world):
    site.make_cell(world, "c2")
    answer = site.post("/campaigns", {"cell": "c2", "kind": "health", "poses": 8})
    assert answer.status_code == 404
    assert "no released parameters" in answer.json()["detail"]

import pytest

NEST = {"name": "r1", "xyz_mm": [2000, 100, 300]}


def test_a_created_cell_is_shown_with_its_defaults_and_not_armed(client):
    body = {
        "name": "cell-7",
        "robot": {"model": "ur5e", "driver": "mock", "address": "127.0.0.1:4000"},
        "tracker": {"driver": "geocom", "address": "/dev/ttyS0", "sigma_mm": 0.6},
    }
    created = client.post("cells", json=body)
    assert created.status_code == 201
    shown = client.get("cells/cell-7").json()
    assert shown == created.json()
    assert shown["armed"] is False
    assert shown["robot"] == body["robot"]
    assert shown["tracker"]["sigma_mm"] == 0.6
    assert shown["tracker"]["sigma_ppm"] == 6.0
    assert shown["limits"]["speed_deg_s"] == 30.0
    assert shown["limits"]["floor_mm"] == 0.0
    assert (shown["temperature_probe"], shown["stage_sensors"]) == (None, [])
    assert [entry["name"] for entry in client.get("cells").json()["cells"]] == ["cell-7"]


def test_arming_and_disarming_is_seen_at_the_cell(client, cell):
    assert client.get("cells/c1").json()["armed"] is True
    assert client.post("cells/c1/disarm").json()["armed"] is False
    assert client.get("cells/c1").json()["armed"] is False


def test_a_second_cell_of_the_same_name_is_a_conflict(client, cell):
    answer = client.post("cells", json=cell)
    assert answer.status_code == 409
    assert "'c1'" in answer.json()["detail"]


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"robot": {"model": "ur99", "driver": "mock", "address": "a"}}, "ur10e"),
        ({"robot": {"model": "ur5", "driver": "magic", "address": "a"}}, "ur_rtde"),
        ({"tracker": {"driver": "magic", "address": "a"}}, "geocom"),
        ({"tracker": {"driver": "mock", "address": "a", "sigma_mm": 0}}, "sigma_mm"),
        ({"colour": "red"}, "colour"),
        ({"name": "../etc"}, "name"),
        ({"limits": {"speed_deg_s": -1}}, "limits.speed_deg_s"),
        ({"limits": {"speed_deg_s": 91}}, "limits.speed_deg_s"),
        ({"limits": {"joints": {"j7_deg": [0, 1]}}}, "no joint 'j7_deg'"),
        ({"limits": {"joints": {"j1_deg": [-400, 0]}}}, "robot's own -360 to 360"),
        ({"limits": {"joints": {"j1_deg": [10, 10]}}}, "must rise"),
        ({"limits": {"workspace_mm": {"low": [0, 0, 0], "high": [1, 0, 1]}}}, "lower corner"),
        ({"temperature_probe": {"driver": "magic", "address": "a"}}, "modbus_temperature"),
        ({"stage_sensors": [{"name": "rod", "driver": "magic", "address": "a"}]}, "dimetix"),
        ({"references": {"nests": []}}, "references.nests"),
        ({"references": {"nests": [NEST, NEST]}}, "same name"),
    ],
)
def test_a_wrong_field_is_named_in_one_sentence(client, change, word):
    good = {
        "name": "c2",
        "robot": {"model": "ur10e", "driver": "mock", "address": "127.0.0.1:9"},
        "tracker": {"driver": "mock", "address": "127.0.0.1:9"},
    }
    answer = client.post("cells", json=good | change)
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert word in answer.json()["detail"]
    assert "\n" not in answer.json()["detail"]
    assert client.get("cells").json()["cells"] == []


def test_an_unknown_cell_is_404_with_a_sentence(client):
    for answer in (client.get("cells/nowhere"), client.post("cells/nowhere/arm")):
        assert answer.status_code == 404
        assert "no cell named 'nowhere'" in answer.json()["detail"]


def test_a_check_of_devices_that_are_not_there_says_so_for_each(client, cell):
    answer = client.post("cells/c1/check")
    assert answer.status_code == 200
    found = answer.json()
    assert found["ok"] is False
    for device in ("robot", "tracker"):
        assert found[device]["ok"] is False
        assert "127.0.0.1:9" in found[device]["detail"]


def test_an_unknown_path_and_a_wrong_method_are_problem_json(client):
    for answer, status in ((client.get("nothing"), 404), (client.delete("cells"), 405)):
        assert answer.status_code == status
        assert answer.headers["content-type"] == "application/problem+json"
        assert set(answer.json()) == {"type", "title", "status", "detail"}


def test_a_change_replaces_the_sections_given_and_disarms(client, cell):
    answer = client.patch(
        "cells/c1",
        json={
            "limits": {"speed_deg_s": 30, "joints": {"j1_deg": [-90, 90]}},
            "temperature_probe": {"driver": "mock", "address": "127.0.0.1:9"},
        },
    )
    assert answer.status_code == 200
    shown = client.get("cells/c1").json()
    assert shown == answer.json()
    assert shown["armed"] is False
    assert shown["limits"]["speed_deg_s"] == 30
    assert shown["limits"]["joints"] == {"j1_deg": [-90, 90]}
    assert shown["robot"] == cell["robot"]
    assert shown["temperature_probe"]["driver"] == "mock"
    client.patch("cells/c1", json={"temperature_probe": None})
    assert client.get("cells/c1").json()["temperature_probe"] is None


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"robot": None}, "body robot"),
        ({"limits": {"joints": {"j9_deg": [0, 1]}}}, "j9_deg"),
        ({"tracker": {"driver": "magic", "address": "a"}}, "geocom"),
        ({"name": "c2"}, "name"),
    ],
)
def test_a_wrong_change_is_refused_and_changes_nothing(client, cell, change, word):
    before = client.get("cells/c1").json()
    answer = client.patch("cells/c1", json=change)
    assert answer.status_code == 422
    assert word in answer.json()["detail"]
    assert client.get("cells/c1").json() == before


def test_a_cell_with_an_open_campaign_is_not_changed(client, cell):
    client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": 8})
    answer = client.patch("cells/c1", json={"limits": {"speed_deg_s": 30}})
    assert answer.status_code == 409
    assert "Campaign 1" in answer.json()["detail"]
    client.post("campaigns/1/abort")
    assert client.patch("cells/c1", json={"limits": {"speed_deg_s": 30}}).status_code == 200
    other = {"robot": cell["robot"] | {"model": "ur5e"}}
    refused = client.patch("cells/c1", json=other)
    assert refused.status_code == 409
    assert "make a new cell" in refused.json()["detail"]


def test_the_check_names_the_probe_and_every_stage_sensor(client, cell):
    devices = {"driver": "mock", "address": "127.0.0.1:9"}
    client.patch(
        "cells/c1",
        json={"temperature_probe": devices, "stage_sensors": [devices | {"name": "rod"}]},
    )
    found = client.post("cells/c1/check").json()
    assert found["ok"] is False
    assert "127.0.0.1:9" in found["temperature_probe"]["detail"]
    assert "127.0.0.1:9" in found["stage_sensors"]["rod"]["detail"]

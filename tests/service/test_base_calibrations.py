"""Base calibrations through the REST interface, without any device."""

import copy
import csv
import io
import zipfile

import pytest

from service.base_calibrations import store, transforms
from service.base_calibrations.models import NewTouch
from service.parameters import store as parameters
from service.procedures.calibrate_base import TakenTouch
from tests.robocal.formats.calibrated_arms import calibrated_arm
from tests.service.released_arm import WHY, content_of

NOWHERE = {"driver": "mock", "address": "127.0.0.1:9"}
BODY = {
    "name": "pair",
    "master": {"robot": {"model": "ur10e", **NOWHERE}, "needle_mm": [0, 0, 150]},
    "slave": {"robot": {"model": "abb_irb910sc", **NOWHERE}, "needle_mm": [0, 0, 100]},
    "stage": {
        "sensors": {"slide": NOWHERE, "rod_angle": NOWHERE, "rod_length": NOWHERE},
        "slide_range_mm": [0, 1500],
        "rod_length_range_mm": [250, 450],
    },
}
SLAVE_TOUCH = TakenTouch((0.1, 0.2, 0.05, 0.3), (1.5, 0.5, 0.3), (0.0, 1e-5, 2e-6), 5)
SOUND = {"transform": {"xyz_mm": [1, 0, 0]}, "undetermined": [], "faults": []}
OPEN = {"undetermined": [{"direction": "turn about R1R2", "fixed_by": "a touch"}]}
MASTER_TOUCH = TakenTouch((0.1, -1.2, 1.5, 0.3, 0.2, 0.0), (0.0, 0.0, 0.35), (0.0, 0.0, 0.0), 5)


def body(**changes):
    """The body with values at dotted places replaced; None takes a value out."""
    changed = copy.deepcopy(BODY)
    for place, value in changes.items():
        *path, last = place.split("__")
        node = changed
        for name in path:
            node = node[name]
        if value is None:
            del node[last]
        else:
            node[last] = value
    return changed


def refused(answer, status: int) -> str:
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    return answer.json()["detail"]


def add_touch(database, number: int, robot: str, cup: str, **more: object) -> None:
    taken = MASTER_TOUCH if robot == "master" else SLAVE_TOUCH
    with database.write() as session:
        store.add_touch(session, number, NewTouch(robot=robot, cup=cup, **more), taken)


@pytest.fixture
def number(client) -> int:
    answer = client.post("base-calibrations", json=BODY)
    assert answer.status_code == 201, answer.text
    return answer.json()["id"]


def test_a_new_one_asks_for_the_first_touch_of_figure_2(client, number):
    shown = client.get(f"base-calibrations/{number}").json()
    assert (shown["state"], shown["touches"], shown["may_finish"]) == ("touching", [], False)
    first = shown["next_touch"]
    assert (first["step"], first["robot"], first["cup"]) == ("P1", "master", "rod")
    assert (first["rod_angle_deg"], first["rod_length_mm"]) == (0, 350)
    assert "rod cup" in first["why"]
    heads = client.get("base-calibrations").json()["base_calibrations"]
    assert [(head["id"], head["touches"]) for head in heads] == [(number, 0)]


def test_the_same_key_starts_one(client):
    answers = [
        client.post("base-calibrations", json=BODY, headers={"Idempotency-Key": "k"})
        for _ in range(2)
    ]
    assert answers[0].json() == answers[1].json()
    assert len(client.get("base-calibrations").json()["base_calibrations"]) == 1


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"master__robot__model": "r2d2"}, "master.robot.model: 'r2d2' is not known"),
        ({"slave__robot__driver": "smoke"}, "slave.robot.driver: 'smoke'"),
        ({"stage__sensors__slide__driver": "rope"}, "stage.sensors.slide.driver: 'rope'"),
        ({"stage__prior_std": {"heat_mm": 1}}, "stage.prior_std: 'heat_mm' is not known"),
        ({"stage__slide_range_mm": [5, 5]}, "slide_range_mm: the lower end 5 is not below 5"),
        ({"stage__rod_length_range_mm": [-1, 5]}, "a rod is longer than zero"),
        ({"stage__sigma_rod_mm": 0}, "sigma_rod_mm"),
        ({"stage__sensors": None}, "give the sensors"),
        ({"master__cell": "c1"}, "either cell or robot"),
        ({"master__robot": None}, "either cell or robot"),
        ({"slave__geometry": "released"}, "released geometry is that of a cell"),
        ({"master__needle_mm": [1, 2]}, "needle_mm"),
    ],
)
def test_what_cannot_be_is_refused_by_its_field(client, wrong, said):
    assert said in refused(client.post("base-calibrations", json=body(**wrong)), 422)


def test_robot_and_sensors_may_be_those_of_a_cell(client, cell):
    sensors = [{"name": name, **NOWHERE} for name in ("slide", "angle")]
    wanted = body(master__robot=None, master__cell="c1", stage__sensors=None)
    assert client.patch("cells/c1", json={"stage_sensors": sensors}).status_code == 200
    assert "no stage sensor named rod" in refused(
        client.post("base-calibrations", json=wanted), 422
    )
    sensors.append({"name": "rod", **NOWHERE})
    assert client.patch("cells/c1", json={"stage_sensors": sensors}).status_code == 200
    made = client.post("base-calibrations", json=wanted).json()
    assert made["settings"]["stage"]["sensors"]["rod_length"]["address"] == NOWHERE["address"]
    wanted["master"]["geometry"] = "released"
    assert "no released parameters" in refused(client.post("base-calibrations", json=wanted), 404)


def test_released_parameters_with_effects_are_refused_before_the_first_touch(
    client, database, cell
):
    content = content_of(calibrated_arm("ur5e"))
    model = {**content.model, "effects": [{"effect": "joint_compliance", "joint": 2}]}
    client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": 8})
    with database.write() as session:
        parameters.add_candidate(session, "c1", 1, content.model_copy(update={"model": model}))
    assert client.post("cells/c1/parameters/1/release", json=WHY).status_code == 200
    wanted = body(master__robot=None, master__cell="c1", master__geometry="released")
    assert "body master.geometry: the released parameters of cell 'c1' have effects" in refused(
        client.post("base-calibrations", json=wanted), 422
    )


def test_a_touch_is_refused_with_the_device_that_does_not_answer(client, number):
    answer = client.post(
        f"base-calibrations/{number}/touches", json={"robot": "slave", "cup": "rod"}
    )
    assert "the slave is not read" in refused(answer, 409)
    assert client.get(f"base-calibrations/{number}").json()["touches"] == []


def test_touches_are_counted_by_placement_and_the_order_follows_what_was_touched(
    client, database, number
):
    def asked() -> str:
        return client.get(f"base-calibrations/{number}").json()["next_touch"]["step"]

    add_touch(database, number, "master", "slide")
    assert asked() == "P1"
    add_touch(database, number, "master", "rod")
    assert asked() == "R1"
    add_touch(database, number, "slave", "rod")
    assert asked() == "R2"
    add_touch(database, number, "slave", "slide", stage_moved=True)
    assert asked() == "P1"
    placements = [
        t["placement"] for t in client.get(f"base-calibrations/{number}").json()["touches"]
    ]
    assert placements == [0, 0, 0, 1]


def test_a_voided_touch_is_kept_and_does_not_count(client, database, number):
    add_touch(database, number, "master", "rod")
    add_touch(database, number, "slave", "rod")
    path = f"base-calibrations/{number}/touches/1/void"
    assert "reason" in refused(client.post(path, json={"reason": " "}), 422)
    assert client.post(path, json={"reason": "needle beside the cup"}).json()["voided"]
    assert "voided already" in refused(client.post(path, json={"reason": "again"}), 409)
    assert "no touch 7" in refused(
        client.post(path.replace("1/void", "7/void"), json={"reason": "x"}), 404
    )
    shown = client.get(f"base-calibrations/{number}").json()
    assert [touch["void_reason"] for touch in shown["touches"]] == ["needle beside the cup", ""]
    packed = client.get(f"base-calibrations/{number}/bundle").content
    with zipfile.ZipFile(io.BytesIO(packed)) as files:
        rows = [*csv.DictReader(io.StringIO(files.read("touches.csv").decode()))]
    assert [row["robot"] for row in rows] == ["slave"]
    assert float(rows[0]["j3_mm"]) == pytest.approx(50.0)
    assert float(rows[0]["slide_mm"]) == pytest.approx(1500.0)


def test_too_few_touches_are_not_finished_and_an_impossible_set_says_why(client, database, number):
    answer = client.post(f"base-calibrations/{number}/finish")
    assert "needs two touches by the master and two by the slave" in refused(answer, 409)
    assert "no result yet" in refused(client.get(f"base-calibrations/{number}/result"), 404)
    for robot in ("master", "master", "slave", "slave"):
        add_touch(database, number, robot, "rod")
    shown = client.get(f"base-calibrations/{number}").json()
    assert shown["assessment"] is None
    assert "different cup places" in shown["no_answer"]
    assert "different cup places" in refused(client.post(f"base-calibrations/{number}/finish"), 422)


def test_what_does_not_exist_is_named(client):
    assert refused(client.get("base-calibrations/7"), 404) == "There is no base calibration 7."
    assert "'pair'" in refused(client.get("base-transforms/pair"), 404)
    assert "'pair'" in refused(client.get("base-transforms/pair/versions"), 404)
    assert "no version 3" in refused(client.post("base-transforms/pair/3/release"), 404)
    assert refused(client.post("base-calibrations/7/finish"), 404)
    assert refused(client.get("base-calibrations/7/sensors"), 404)
    assert refused(client.get("base-calibrations/7/bundle"), 404)


@pytest.fixture
def versions(client, database) -> None:
    """Three candidates of one pair."""
    for _ in range(3):
        number = client.post("base-calibrations", json=BODY).json()["id"]
        with database.write() as session:
            transforms.add_candidate(
                session,
                name="pair",
                calibration=number,
                document=SOUND | ({} if number != 2 else OPEN),
                bundle_sha256="0" * 64,
                software_version="1",
                settings={},
                person="eve",
            )


@pytest.mark.usefixtures("versions")
def test_one_version_is_released_and_rolled_back(client):
    path = "base-transforms/pair"
    assert "version 3 is a candidate" in refused(client.get(path), 404)
    for version in (1, 3):
        assert client.post(f"{path}/{version}/release").json()["state"] == "released"
    assert client.get(path).json()["version"] == 3
    assert "roll back to it" in refused(client.post(f"{path}/1/release"), 409)
    assert "a rollback goes to" in refused(client.post(f"{path}/2/rollback"), 409)
    why = {"reason": "the third was made in the cold"}
    assert client.post(f"{path}/1/rollback", json=why).json()["version"] == 1
    found = client.get(f"{path}/versions").json()
    states = {version["version"]: version["state"] for version in found["versions"]}
    assert states == {1: "released", 2: "candidate", 3: "superseded"}
    steps = [(step["version"], step["event"]) for step in found["history"]]
    assert steps[:3] == [(1, "rolled_back"), (3, "superseded"), (3, "released")]
    assert steps[-3:] == [(3, "made"), (2, "made"), (1, "made")]
    assert found["history"][0]["reason"] == why["reason"]
    assert client.get(path, params={"version": 2}).json()["state"] == "candidate"
    assert client.get(path, params={"state": "superseded"}).json()["version"] == 3
    assert refused(client.get(path, params={"version": 2, "state": "released"}), 422)


@pytest.mark.usefixtures("versions")
def test_a_doubtful_version_is_released_with_a_reason_only(client):
    path = "base-transforms/pair/2/release"
    assert "turn about R1R2 is left open" in refused(client.post(path), 409)
    why = {"reason": "both bases stand level"}
    assert client.post(path, json=why).json()["state"] == "released"


@pytest.mark.usefixtures("versions")
def test_an_unchanged_transform_is_not_sent_again(client):
    client.post("base-transforms/pair/1/release")
    etag = client.get("base-transforms/pair").headers["etag"]
    again = client.get("base-transforms/pair", headers={"If-None-Match": etag})
    assert (again.status_code, again.content) == (304, b"")
    client.post("base-transforms/pair/3/release")
    changed = client.get("base-transforms/pair", headers={"If-None-Match": etag})
    assert changed.json()["version"] == 3

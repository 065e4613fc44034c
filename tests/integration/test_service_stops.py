"""Abort, pause, disarm, device failures, SIGTERM: the robot stands, and the campaign knows why."""

import json
import math
import re
import sqlite3
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing

import numpy as np
import pytest
from service_cell import START_DEG, emulated_world, installation, poses_about_start, wait_until

POSES = 40
FAR = [
    {f"j{joint}_deg": sign * 150.0 if joint == 1 else -45.0 for joint in range(1, 7)}
    for sign in (1, -1, 1, -1)
]


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    """One service and worker for the tests that leave both as they were."""
    with installation(tmp_path_factory.mktemp("site")) as running:
        yield running


@pytest.fixture
def own(tmp_path):
    """A service and a worker that a test may end."""
    with installation(tmp_path, lease_s=1.0) as running:
        yield running


@pytest.fixture
def world(tmp_path):
    with emulated_world(tmp_path, time_scale=30) as running:
        yield running


@pytest.fixture
def cell(shared, world, request):
    """An armed cell of this test alone; what still runs there at the end is aborted."""
    name = f"cell-{abs(hash(request.node.name))}"
    shared.make_cell(world, name)
    yield name
    for campaign in shared.get("/campaigns", params={"cell": name}).json()["campaigns"]:
        shared.post(f"/campaigns/{campaign['id']}/abort")
    wait_until(lambda: shared.rows("SELECT 1 FROM job WHERE state = 'running'") == [])


def moving(world) -> bool:
    return world.ask("robot")["moving"]


def slow_motion(site, world, cell) -> int:
    """A campaign whose robot is in the middle of a motion of several seconds."""
    world.ask("set", name="time_scale", value=1)
    number = site.start_campaign(FAR, cell)
    wait_until(lambda: moving(world))
    return number


@pytest.mark.parametrize(
    ("path", "state", "reason"),
    [
        ("/campaigns/{number}/abort", "aborted", "aborted by a person"),
        ("/campaigns/{number}/pause", "paused", "paused by a person"),
        ("/cells/{cell}/disarm", "paused", "disarmed"),
    ],
)
def test_a_person_stops_the_robot_in_the_middle_of_a_motion(
    shared, world, cell, path, state, reason
):
    number = slow_motion(shared, world, cell)
    asked = time.monotonic()
    assert shared.post(path.format(number=number, cell=cell)).status_code == 200
    wait_until(lambda: not moving(world))
    # From 60 deg/s with 10 rad/s2: a tenth of a second besides the time to notice.
    assert time.monotonic() - asked < 1.5
    shown = shared.await_state(number, state)
    assert reason in shown["reason"]
    assert shown["done"] == 0
    assert shared.rows("SELECT count(*) FROM job WHERE state = 'running'") == [(0,)]
    robot = world.ask("robot")
    assert not robot["moving"]
    # Where it stands after braking, not where it was seen while it moved.
    ((kept,),) = shared.rows(f"SELECT joints FROM whereabouts WHERE campaign = {number}")
    assert json.loads(kept) == pytest.approx(robot["joints"], abs=1e-9)
    if state == "aborted":
        told = shared.get(f"/campaigns/{number}/events").text
        angles = json.loads(re.search(r"event: arm\ndata: (.*)", told)[1])["joints"]
        assert np.radians(angles) == pytest.approx(robot["joints"], abs=1e-4)


def test_an_abort_stops_the_robot_while_another_writer_holds_the_database(shared, world, cell):
    number = slow_motion(shared, world, cell)
    with (
        closing(sqlite3.connect(shared.database, isolation_level=None)) as writer,
        ThreadPoolExecutor(1) as aside,
    ):
        writer.execute("BEGIN IMMEDIATE")
        try:
            answer = aside.submit(shared.post, f"/campaigns/{number}/abort")
            wait_until(lambda: not moving(world))
            assert not answer.done()
        finally:
            writer.execute("ROLLBACK")
        assert answer.result().status_code == 200
    shown = shared.await_state(number, "aborted")
    assert shown["done"] == 0
    assert not list(shared.database.parent.glob("*-stop-*"))


def test_an_abort_is_final_whatever_is_asked_for_after_it(shared, world, cell):
    number = slow_motion(shared, world, cell)
    assert shared.post(f"/campaigns/{number}/abort").status_code == 200
    refused = shared.post(f"/campaigns/{number}/pause")
    assert refused.status_code == 409
    assert "abort" in refused.json()["detail"]
    assert shared.await_state(number, "aborted", "paused")["state"] == "aborted"


def test_a_paused_campaign_goes_on_at_the_next_unmeasured_pose(shared, world, cell):
    number = shared.start_campaign(poses_about_start(POSES), cell)
    shared.await_done(number, 5)
    shared.post(f"/campaigns/{number}/pause")
    paused = shared.await_state(number, "paused")
    assert 5 <= paused["done"] < POSES
    before = shared.rows(
        f"SELECT idx, joints, created FROM reading WHERE campaign = {number} ORDER BY idx"
    )
    assert shared.post(f"/campaigns/{number}/resume").json()["state"] == "queued"
    shared.await_done(number, POSES)
    after = shared.rows(
        f"SELECT idx, joints, created FROM reading WHERE campaign = {number} ORDER BY idx"
    )
    assert after[: len(before)] == before
    assert [row[0] for row in after] == list(range(POSES))


def test_an_aborted_campaign_keeps_its_readings_and_disarms_the_cell(shared, world, cell):
    number = shared.start_campaign(poses_about_start(POSES), cell)
    shared.await_done(number, 5)
    shared.post(f"/campaigns/{number}/abort")
    shown = shared.await_state(number, "aborted")
    assert shown["finished"] is not None
    rows = shared.get(f"/campaigns/{number}/measurements").json()["rows"]
    assert len(rows) == shown["done"] >= 5
    assert shared.get(f"/cells/{cell}").json()["armed"] is False


def test_a_blocked_beam_pauses_the_campaign_until_it_is_cleared(shared, world, cell):
    number = shared.start_campaign(poses_about_start(POSES), cell)
    shared.await_done(number, 3)
    world.ask("set", name="beam_blocked", value=True)
    shown = shared.await_state(number, "paused")
    assert "tracker mock" in shown["reason"]
    assert "line of sight" in shown["reason"]
    world.ask("set", name="beam_blocked", value=False)
    shared.post(f"/campaigns/{number}/resume")
    shared.await_done(number, POSES)
    attempts = shared.rows(
        f"SELECT idx, attempt FROM pose WHERE campaign = {number} AND attempt > 1"
    )
    assert len(attempts) == 1
    assert attempts[0][0] == shown["done"]


def test_a_pose_that_cannot_be_measured_can_be_skipped(shared, world, cell):
    number = shared.start_campaign(poses_about_start(POSES), cell)
    shared.await_done(number, 3)
    world.ask("set", name="beam_blocked", value=True)
    stuck = shared.await_state(number, "paused")["done"]
    world.ask("set", name="beam_blocked", value=False)
    shared.post(f"/campaigns/{number}/resume", {"skip_pose": True})
    shared.await_done(number, POSES - 1)
    assert shared.campaign(number)["total"] == POSES - 1
    assert shared.rows(f"SELECT idx FROM pose WHERE campaign = {number} AND state = 'skipped'") == [
        (stuck,)
    ]


def test_an_emergency_stop_pauses_the_campaign_with_advice(shared, world, cell):
    number = slow_motion(shared, world, cell)
    world.ask("set", name="safety", value="emergency_stop")
    shown = shared.await_state(number, "paused")
    assert "emergency" in shown["reason"].lower()
    world.ask("set", name="safety", value="normal")
    world.ask("set", name="time_scale", value=60)
    shared.post(f"/campaigns/{number}/resume")
    shared.await_done(number, len(FAR))


def test_devices_that_are_not_there_pause_the_campaign_naming_the_address(shared, world):
    cell = {
        "name": "dark",
        "robot": {"model": "ur10e", "driver": "mock", "address": "127.0.0.1:9"},
        "tracker": {"driver": "mock", "address": world.address},
    }
    shared.post("/cells", cell)
    shared.post("/cells/dark/arm")
    number = shared.start_campaign(poses_about_start(2), cell="dark")
    shown = shared.await_state(number, "paused")
    assert "robot mock at 127.0.0.1:9" in shown["reason"]


def test_a_worker_told_to_end_stops_the_robot_and_gives_the_job_back(own, world):
    own.make_cell(world)
    number = slow_motion(own, world, "c1")
    worker = own._processes[-1]
    assert worker.end() == 0
    wait_until(lambda: not moving(world), 2)
    shown = own.campaign(number)
    assert shown["state"] == "queued"
    assert own.rows("SELECT state, worker FROM job") == [("queued", "")]
    world.ask("set", name="time_scale", value=60)
    own.start_worker()
    own.await_done(number, len(FAR))


def test_abort_takes_effect_although_the_worker_is_dead(own, world):
    own.make_cell(world)
    number = own.start_campaign(poses_about_start(POSES))
    own.await_done(number, 2)
    own._processes[-1].kill()
    abort = f"/campaigns/{number}/abort"
    wait_until(lambda: own.post(abort).json().get("state") == "aborted", period_s=0.1)
    own.start_worker()
    assert own.rows("SELECT state FROM job") == [("cancelled",)]


def test_a_service_told_to_end_does_so_at_once_although_a_page_listens(own, world):
    own.make_cell(world)
    number = slow_motion(own, world, "c1")
    with own.client.stream("GET", f"/campaigns/{number}/events") as live:
        lines = live.iter_lines()
        assert next(lines).startswith("id: ")
        began = time.monotonic()
        own.service.end()
        assert time.monotonic() - began < 6


def test_a_page_is_told_where_the_arm_is_while_it_moves(shared, world, cell):
    number = slow_motion(shared, world, cell)
    angles = []
    with shared.client.stream("GET", f"/campaigns/{number}/events") as live:
        lines = live.iter_lines()
        while len(angles) < 4:
            if next(lines) == "event: arm":
                told = json.loads(next(lines).removeprefix("data: "))
                assert (told["columns"][0], len(told["arm_mm"][0])) == ("j1_deg", 3)
                angles.append(told["joints"][0])
        by_now = math.degrees(world.ask("robot")["joints"][0])
    # It set out for +150 degrees, and nobody has read a pose yet.
    assert START_DEG[0] <= angles[0] < angles[1] < angles[2] < angles[3] <= by_now < 150.0
    assert shared.campaign(number)["done"] == 0


def test_heartbeats_keep_a_silent_stream_alive(tmp_path, world):
    with installation(tmp_path, workers=0, events_heartbeat_s=0.1) as site:
        site.make_cell(world)
        number = site.start_campaign(poses_about_start(1))
        with site.client.stream("GET", f"/campaigns/{number}/events") as live:
            seen = []
            for line in live.iter_lines():
                seen.append(line)
                if line.startswith(":"):
                    break
        assert any(line == "event: progress" for line in seen)

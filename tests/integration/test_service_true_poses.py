"""A pose is driven to only when that is allowed, and measured only when it is true."""

import csv
import io
import math
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from service_cell import (
    ENDED,
    START_DEG,
    Process,
    emulated_world,
    installation,
    poses_about_start,
    wait_until,
)

from robocal.formats.bundle import read_bundle
from robocal.identification.station_drift import find_drift

NEST = {"name": "r1", "xyz_mm": [2000, -300, 500]}
BELOW_THE_FLOOR = {f"j{joint}_deg": 0.0 for joint in range(1, 7)}


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    with installation(tmp_path_factory.mktemp("site")) as running:
        yield running


@pytest.fixture
def world(tmp_path):
    nests = {NEST["name"]: NEST["xyz_mm"]}
    with emulated_world(tmp_path, nests=nests, temperature={"final_degc": 30.0}) as running:
        yield running


@pytest.fixture
def cell(site, world, request):
    """A cell of this test alone, not armed yet."""
    name = f"cell-{abs(hash(request.node.name))}"
    site.make_cell(world, name, armed=False)
    return name


@contextmanager
def emulator(name: str, *arguments: str) -> Iterator[Process]:
    """An emulator in its own process."""
    running = Process(f"drivers.emulators.{name}", *arguments, environment={})
    try:
        yield running
    finally:
        running.kill()


def change(site, cell: str, **sections: object) -> None:
    answer = site.client.patch(f"/cells/{cell}", json=sections)
    assert answer.status_code == 200, answer.text


def measured(site, cell: str, poses: object, **more: object) -> int:
    """A campaign that has ended, with or without a result."""
    assert site.post(f"/cells/{cell}/arm").status_code == 200
    number = site.start_campaign(poses, cell, **more)
    shown = site.await_state(number, *ENDED, "paused")
    assert shown["state"] in ("finished", "failed"), shown
    return number


def driven(site, cell: str, poses: object, **more: object) -> int:
    """A campaign that was driven to its end; nobody waits for its numbers."""
    assert site.post(f"/cells/{cell}/arm").status_code == 200
    number = site.start_campaign(poses, cell, **more)
    analyses = f"SELECT count(*) FROM job WHERE campaign = {number} AND kind = 'analyse'"
    wait_until(lambda: site.rows(analyses) == [(1,)], period_s=0.05)
    site.post(f"/campaigns/{number}/abort")
    # A worker that has the job already needs a moment to let go of the cell.
    site.await_state(number, *ENDED)
    return number


def rows(site, number: int) -> list[dict]:
    return site.get(f"/campaigns/{number}/measurements").json()["rows"]


def sides(row: dict) -> tuple[float, ...]:
    return tuple(row[f"approach{joint}"] for joint in range(1, 7))


def skipped(site, number: int) -> dict[int, str]:
    found = site.get(f"/campaigns/{number}/poses", params={"state": "skipped"}).json()
    return {pose["pose"]: pose["reason"] for pose in found["poses"]}


def places_driven_to(world) -> list[list[float]]:
    stops = world.ask("truth")["circumstances"]["stops"]
    return [[math.degrees(q) for q in stop] for stop in stops]


def test_every_joint_comes_from_either_side_and_from_the_other_at_the_next_repeat(
    site, world, cell
):
    number = driven(site, cell, poses_about_start(6), repeats=2)
    seen = rows(site, number)
    first = {row["pose"]: sides(row) for row in seen if row["repeat"] == 0}
    second = {row["pose"]: sides(row) for row in seen if row["repeat"] == 1}
    for pose, signs in first.items():
        assert second[pose] == tuple(-sign for sign in signs)
    for joint in range(6):
        assert sum(signs[joint] for signs in first.values()) == 0
    # The world remembers how its joints really moved last.
    assert tuple(world.ask("truth")["circumstances"]["last_motion"]) == sides(seen[-1])
    assert {row["speed"] for row in seen} == {round(30 / 180, 6)}


def test_without_an_offset_the_robot_comes_straight(site, world, cell):
    poses = poses_about_start(4)
    driven(site, cell, poses, approach_deg=0)
    wanted = [START_DEG, *([pose[f"j{joint}_deg"] for joint in range(1, 7)] for pose in poses)]
    places = places_driven_to(world)
    assert len(places) == len(wanted)
    for place, pose in zip(places, wanted, strict=True):
        assert place == pytest.approx(pose, abs=1e-6)


def test_what_breaks_a_bound_is_skipped_with_its_reason_and_never_driven_to(site, world, cell):
    good = poses_about_start(3)
    number = driven(site, cell, [good[0], BELOW_THE_FLOOR, *good[1:]])
    reasons = skipped(site, number)
    assert list(reasons) == [1]
    assert "floor" in reasons[1]
    shown = site.campaign(number)
    assert (shown["done"], shown["total"], shown["skipped"]) == (3, 3, 1)
    assert all(max(map(abs, place)) > 1 for place in places_driven_to(world))
    attempts = site.get(f"/campaigns/{number}/poses").json()["poses"]
    assert [pose["attempts"] for pose in attempts] == [1, 0, 1, 1]


def test_a_campaign_with_too_few_poses_says_so_and_what_it_cannot_identify(site, world, cell):
    number = measured(site, cell, [*poses_about_start(3), BELOW_THE_FLOOR])
    shown = site.campaign(number)
    assert shown["state"] == "failed"
    assert "1 of 4 poses were skipped" in shown["reason"]
    assert "floor" in shown["reason"]
    assert "cannot identify" in shown["reason"]
    assert "theta_" in shown["reason"] or "alpha_" in shown["reason"]
    assert "\n" not in shown["reason"]


def test_planned_poses_keep_the_bounds_of_the_cell(site, world, cell):
    low, high = [-1500, -1500, 100], [1500, 1500, 1500]
    limits = {
        "workspace_mm": {"low": low, "high": high},
        "joints": {"j1_deg": [-120, 120]},
        "target_mm": [0, 0, 100],
    }
    change(site, cell, limits=limits)
    number = driven(site, cell, 16)
    assert skipped(site, number) == {}
    seen = rows(site, number)
    assert len(seen) == 16
    assert all(abs(row["cmd1_deg"]) <= 120 for row in seen)


def test_temperature_and_payload_stand_in_every_row_and_in_the_bundle(site, world, cell, tmp_path):
    world.ask("set", name="temperature_degc", value=27.5)
    change(site, cell, temperature_probe={"driver": "mock", "address": world.address})
    number = driven(site, cell, poses_about_start(3), payload_kg=2.5)
    seen = rows(site, number)
    assert {row["temperature_degc"] for row in seen} == {27.5}
    content = site.get(f"/campaigns/{number}/bundle").content
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        table = list(csv.DictReader(io.StringIO(archive.read("measurements.csv").decode())))
    assert {row["payload_kg"] for row in table} == {"2.5"}
    assert {row["temperature_degc"] for row in table} == {"27.5"}


def test_a_probe_that_is_not_there_pauses_the_campaign_naming_it(site, world, cell):
    change(site, cell, temperature_probe={"driver": "mock", "address": "127.0.0.1:9"})
    site.post(f"/cells/{cell}/arm")
    number = site.start_campaign(poses_about_start(2), cell)
    assert "temperature probe" in site.await_state(number, "paused")["reason"]
    site.post(f"/campaigns/{number}/abort")


def test_fixed_nests_are_measured_again_and_again_and_show_the_drift(site, world, cell, tmp_path):
    change(site, cell, references={"nests": [NEST], "every_poses": 3})
    step = {"effect": "base_step", "step_mm": [2, 0, 0], "after_readings": 8}
    world.ask("set", name="effect", value=step)
    number = driven(site, cell, poses_about_start(11))
    seen = rows(site, number)
    # After the first reading, after every third, and at the end.
    visits = [1, 4, 7, 10, 11]
    expected = [name for i in range(1, 12) for name in (None, *(["r1"] if i in visits else []))]
    assert [row["target"] for row in seen] == expected
    nests = [row for row in seen if row["target"] == "r1"]
    assert nests[0]["x_mm"] == pytest.approx(2000, abs=0.2)
    assert nests[-1]["x_mm"] == pytest.approx(2002, abs=0.2)
    times = [row["t_s"] for row in seen]
    assert times == sorted(times)
    content = site.get(f"/campaigns/{number}/bundle").content
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        archive.extractall(tmp_path)
    bundle = read_bundle(tmp_path)
    assert bundle.targets["r1"].fixed
    of_fixed = np.array([name == "r1" for name in bundle.measurements.target])
    drift = find_drift(bundle.measurements, of_fixed, bundle.instrument)
    assert drift.significant
    assert drift.largest == pytest.approx(2e-3, abs=0.5e-3)


def test_a_pose_whose_shots_scatter_is_retried_and_then_left_out(site, tmp_path):
    with (
        emulated_world(tmp_path, noise={"position_mm": 1.0}) as world,
        emulator("geocom_station", "--world", world.address) as station,
    ):
        devices = {
            "robot": {"model": "ur10e", "driver": "mock", "address": world.address},
            "tracker": {"driver": "geocom", "address": station.ready["port"], "sigma_mm": 0.02},
        }
        assert site.post("/cells", {"name": "scattering", **devices}).status_code == 201
        number = driven(site, "scattering", poses_about_start(1))
        (reason,) = skipped(site, number).values()
        assert "shots scatter" in reason
        assert "seen on 2 visits" in reason
        assert site.get(f"/campaigns/{number}/poses").json()["poses"][0]["attempts"] == 2
        tracker = devices["tracker"] | {"spread_mm": 20.0}
        change(site, "scattering", tracker=tracker)
        number = driven(site, "scattering", poses_about_start(1))
        assert skipped(site, number) == {}
        assert 0.1 < rows(site, number)[0]["spread_mm"] < 20


def test_a_robot_that_is_pushed_away_is_not_believed(site, world, cell):
    """A person leads the arm off its pose, on every visit."""
    pose = poses_about_start(2)[1]
    there = [math.radians(pose[f"j{joint}_deg"]) for joint in range(1, 7)]
    world.ask("set", name="time_scale", value=5)
    site.post(f"/cells/{cell}/arm")
    number = site.start_campaign([pose], cell, settle_s=10.0)
    for _ in range(2):
        wait_until(lambda: world.ask("robot")["joints"] == there)
        # The driver has to have seen the arrival too.
        settled_for_4_s = world.ask("robot")["time_s"] + 4.0
        wait_until(lambda end=settled_for_4_s: world.ask("robot")["time_s"] > end)
        world.ask("guide", joints=[there[0] + 0.01, *there[1:]])
    wait_until(lambda: site.campaign(number)["skipped"] == 1)
    assert "joint 1 is 0.0100" in skipped(site, number)[0]
    assert rows(site, number) == []
    site.post(f"/campaigns/{number}/abort")

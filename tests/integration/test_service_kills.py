"""kill -9 at random moments: no reading lost, none accepted twice, each true to its pose.

The world's sealed truth is the oracle: a reading that was mixed up between two poses, or taken
while the robot moved, would be off by more than the instrument's noise.
"""

import json
import os
import random
import signal
import sqlite3
import time
from contextlib import closing

import numpy as np
import pytest
from service_cell import (
    PATIENCE_S,
    Site,
    World,
    emulated_world,
    installation,
    poses_about_start,
    wait_until,
)

KILLS = 5
POSES = 60
SEED = 20261122
NOISE = 2e-4
"""Instrument and robot scatter are 0.02 mm; ten times that is no reading of this pose [m]"""


@pytest.fixture
def world(tmp_path):
    with emulated_world(tmp_path, time_scale=30) as running:
        yield running


def collect_job(site: Site) -> tuple[str, str, int]:
    """State, worker and fence of the campaign's first job."""
    return site.rows("SELECT state, worker, fence FROM job WHERE kind = 'collect'")[0]


def accepted(site: Site) -> dict[tuple[int, int], tuple]:
    """Every reading by its visit."""
    rows = site.rows("SELECT * FROM reading ORDER BY id")
    by_visit = {(row[2], row[3]): row for row in rows}
    assert len(by_visit) == len(rows)
    return by_visit


def require_complete(site: Site, world: World, snapshots: list[dict], kills: int) -> None:
    """All poses measured once, nothing that was there before a kill gone or changed."""
    final = accepted(site)
    assert sorted(final) == [(pose, 0) for pose in range(POSES)]
    for snapshot in snapshots:
        for visit, row in snapshot.items():
            assert final[visit] == row
    attempts = site.rows("SELECT sum(attempt) FROM pose")[0][0]
    assert POSES <= attempts <= POSES + kills
    for joints, position in site.rows("SELECT joints, position FROM reading"):
        truth = world.ask("truth", joints=json.loads(joints))["position"]
        assert np.linalg.norm(np.subtract(json.loads(position), truth)) < NOISE


def test_a_worker_killed_five_times_loses_and_doubles_nothing(tmp_path, world):
    rng = random.Random(SEED)
    with installation(tmp_path, workers=0, lease_s=1.0) as site:
        site.make_cell(world)
        # Slow, so that the campaign is still under way at the last kill.
        world.ask("set", name="time_scale", value=6)
        number = site.start_campaign(poses_about_start(POSES))
        snapshots = []
        for _ in range(KILLS):
            worker = site.start_worker()
            wait_until(lambda w=worker: collect_job(site)[1] == w.ready["worker"])
            time.sleep(rng.uniform(0.0, 0.6))
            assert collect_job(site)[0] == "running"
            worker.kill()
            snapshots.append(accepted(site))
        site.start_worker()
        world.ask("set", name="time_scale", value=100)
        site.await_done(number, POSES)
        require_complete(site, world, snapshots, KILLS)
        assert collect_job(site)[2] == KILLS + 1


def test_a_service_killed_five_times_does_not_disturb_the_campaign(tmp_path, world):
    rng = random.Random(SEED + 1)
    with installation(tmp_path) as site:
        site.make_cell(world)
        # Slow, so that the campaign is still under way at the last kill.
        world.ask("set", name="time_scale", value=0.2)
        number = site.start_campaign(poses_about_start(POSES))
        snapshots, seen = [], 0
        for _ in range(KILLS):
            time.sleep(rng.uniform(0.0, 0.4))
            done = site.campaign(number)["done"]
            assert done >= seen
            seen = done
            site.service.kill()
            snapshots.append(accepted(site))
            site.start_service()
        assert seen < POSES
        assert site.campaign(number)["state"] == "running"
        world.ask("set", name="time_scale", value=100)
        site.await_done(number, POSES)
        require_complete(site, world, snapshots, 0)


def test_two_workers_share_a_cell_without_meeting(tmp_path, world):
    with installation(tmp_path, workers=2) as site:
        site.make_cell(world)
        site.start_campaign(poses_about_start(12))
        second = site.start_campaign(poses_about_start(12))
        shown = site.await_state(second, "finished", "failed", "paused")
        # Arming ends with the first campaign, so the second waits for a person.
        assert shown["state"] == "paused"
        assert "not armed" in shown["reason"]
        site.post("/cells/c1/arm")
        site.post(f"/campaigns/{second}/resume")
        site.await_done(second, 12)
        spans = site.rows(
            "SELECT campaign, min(id), max(id), count(*) FROM reading GROUP BY campaign"
        )
        assert [span[3] for span in spans] == [12, 12]
        assert spans[0][2] < spans[1][1]


def test_when_one_of_two_workers_is_killed_the_other_goes_on(tmp_path, world):
    with installation(tmp_path, workers=2, lease_s=1.0) as site:
        site.make_cell(world)
        number = site.start_campaign(poses_about_start(20))
        site.await_done(number, 5)
        pid = int(collect_job(site)[1].rpartition(":")[2])
        os.kill(pid, signal.SIGKILL)
        site.await_done(number, 20)
        assert len(accepted(site)) == 20
        assert collect_job(site)[2] == 2


def test_a_worker_frozen_for_longer_than_its_lease_stores_nothing_more(tmp_path, world):
    with installation(tmp_path, workers=1, lease_s=1.0) as site:
        site.make_cell(world)
        number = site.start_campaign(poses_about_start(POSES))
        site.await_done(number, 5)
        frozen = int(collect_job(site)[1].rpartition(":")[2])
        freeze_between_transactions(site, frozen)
        site.start_worker()
        wait_until(lambda: collect_job(site)[2] == 2)
        assert site.rows("SELECT DISTINCT fence FROM reading") in ([(1,)], [(1,), (2,)])
        os.kill(frozen, signal.SIGCONT)
        world.ask("set", name="time_scale", value=100)
        resume_until_done(site, number)
        fences = [row[0] for row in site.rows("SELECT fence FROM reading ORDER BY id")]
        assert fences == sorted(fences)
        assert len(accepted(site)) == POSES


def test_a_database_locked_for_a_while_delays_the_campaign_and_no_more(tmp_path, world):
    with installation(tmp_path, busy_s=0.1, lease_s=1.0) as site:
        site.make_cell(world)
        number = site.start_campaign(poses_about_start(20))
        site.await_done(number, 3)
        with closing(sqlite3.connect(site.database, isolation_level=None)) as other:
            other.execute("BEGIN IMMEDIATE")
            refused = site.post(f"/campaigns/{number}/pause")
            # Longer than the lease, so that the worker has to find its way back.
            time.sleep(1.5)
        assert refused.status_code == 503
        assert "send the request again" in refused.json()["detail"]
        site.await_done(number, 20)
        assert len(accepted(site)) == 20
        assert site.campaign(number)["reason"] == ""


def freeze_between_transactions(site: Site, pid: int) -> None:
    """Freeze a worker; one that is frozen while it writes would hold everybody up."""
    while True:
        os.kill(pid, signal.SIGSTOP)
        with closing(sqlite3.connect(site.database, timeout=0, isolation_level=None)) as probe:
            try:
                probe.execute("BEGIN IMMEDIATE")
            except sqlite3.OperationalError:
                os.kill(pid, signal.SIGCONT)
            else:
                return


def resume_until_done(site: Site, number: int) -> None:
    """Resume where the thawed worker's stop interrupted a motion of the new one."""
    deadline = time.monotonic() + PATIENCE_S
    while site.campaign(number)["done"] < POSES:
        assert time.monotonic() < deadline
        if site.campaign(number)["state"] == "paused":
            site.post(f"/campaigns/{number}/resume")
        time.sleep(0.05)

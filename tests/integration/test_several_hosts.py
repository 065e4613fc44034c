"""Workers that share one PostgreSQL, as on several hosts: killed, frozen, and many at once.

A `kill -9` and a `SIGSTOP` are what a host that lost its power and one that lost its network look
like to the others. The emulated world's own record of motions is the oracle for who moved.
"""

import os
import signal
import time

import numpy as np
import pytest
from service_cell import Site, emulated_world, installation, poses_about_start, wait_until

POSES = 30
NOISE = 2e-4
"""Ten times the scatter of instrument and robot: beyond it a reading is of another pose [m]"""
TAKE_OVER_S = 20.0
"""Promised for the settings as they come."""


@pytest.fixture
def world(tmp_path):
    with emulated_world(tmp_path, time_scale=30) as running:
        yield running


def holder(site: Site) -> tuple[str, int]:
    """Worker and fence of the job that collects."""
    return site.rows("SELECT worker, fence FROM job WHERE kind = 'collect'")[0]


def pid_of(worker: str) -> int:
    return int(worker.rpartition(":")[2])


def require_all_readings_once(site: Site, world, count: int) -> None:
    rows = site.rows("SELECT idx, joints, position FROM reading ORDER BY idx")
    assert [row[0] for row in rows] == list(range(count))
    for _, joints, position in rows:
        truth = world.ask("truth", joints=joints)["position"]
        assert np.linalg.norm(np.subtract(position, truth)) < NOISE


def test_with_settings_as_they_come_a_killed_workers_campaign_is_taken_over_in_time(
    tmp_path, world, postgresql_url
):
    world.ask("set", name="time_scale", value=15)
    with installation(
        tmp_path, workers=2, database_url=postgresql_url, lease_s=10.0, idle_s=0.3
    ) as site:
        site.make_cell(world)
        number = site.start_campaign(poses_about_start(POSES))
        site.await_done(number, 5)
        first, _ = holder(site)
        os.kill(pid_of(first), signal.SIGKILL)
        killed = time.monotonic()
        before = site.rows("SELECT id, idx, position FROM reading ORDER BY id")
        wait_until(lambda: holder(site)[0] not in {first, ""}, TAKE_OVER_S)
        taken = len(site.rows("SELECT id FROM reading"))
        wait_until(lambda: len(site.rows("SELECT id FROM reading")) > taken)
        assert time.monotonic() - killed < TAKE_OVER_S
        world.ask("set", name="time_scale", value=100)
        site.await_done(number, POSES)
        assert site.rows("SELECT id, idx, position FROM reading ORDER BY id")[: len(before)] == (
            before
        )
        require_all_readings_once(site, world, POSES)


def test_a_frozen_worker_that_wakes_neither_stores_nor_moves(tmp_path, world, postgresql_url):
    with installation(tmp_path, workers=1, database_url=postgresql_url, lease_s=1.0) as site:
        site.make_cell(world)
        number = site.start_campaign(poses_about_start(POSES))
        site.await_done(number, 5)
        frozen = pid_of(holder(site)[0])
        os.kill(frozen, signal.SIGSTOP)
        site.start_worker()
        wait_until(lambda: holder(site)[1] == 2)
        site.await_done(number, 10)
        site.post(f"/campaigns/{number}/pause")
        site.await_state(number, "paused")
        there = world.ask("robot")["joints"]
        readings = site.rows("SELECT count(*) FROM reading")
        os.kill(frozen, signal.SIGCONT)
        # It says that it is awake by asking for its next job.
        wait_until(lambda: len(live_workers(site)) == 2)
        assert world.ask("robot")["joints"] == pytest.approx(there, abs=1e-3)
        assert site.rows("SELECT count(*) FROM reading") == readings
        site.post(f"/campaigns/{number}/resume")
        site.await_done(number, POSES)
        fences = [row[0] for row in site.rows("SELECT fence FROM reading ORDER BY id")]
        assert fences == sorted(fences)
        require_all_readings_once(site, world, POSES)


def live_workers(site: Site) -> list[tuple]:
    return site.rows(
        "SELECT id FROM procrastinate.procrastinate_workers "
        "WHERE last_heartbeat > now() - interval '1 second'"
    )

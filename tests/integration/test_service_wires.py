"""A campaign over the real wires: ur-rtde to a controller, GeoCOM over a serial line.

Times are read at the world, whose clock runs as ours does here: from the moment when a person asks,
or a worker dies, to the arm standing still.
"""

import math
from collections.abc import Iterator
from contextlib import ExitStack

import pytest
from service_cell import ENDED, Site, installation
from ur_cell import Cell, Emulator, emulated_cell, wait_until

pytest.importorskip("rtde_control")

POSES = 16
SPEED_DEG_S = 90.0
"""The fastest that a cell may be. With 10 rad/s2 the arm needs 0.16 s to stand still."""
AT_FULL_SPEED = 0.7
"""So far from its start the arm goes at full speed: v^2 / 2a is 0.59 rad [rad]"""
NOISE = 2e-4
"""Ten times what the instrument and the arm scatter; no other pose is as near [m]"""
ABORT_S = 0.3
WORKER_LOST_S = 1.0
FAR = [
    {f"j{joint}_deg": sign * 150.0 if joint == 1 else -45.0 for joint in range(1, 7)}
    for sign in (1, -1)
]


@pytest.fixture(scope="module")
def cell(tmp_path_factory) -> Iterator[Cell]:
    with emulated_cell(tmp_path_factory.mktemp("wires"), number=7, time_scale=20.0) as running:
        yield running


@pytest.fixture(scope="module")
def site(tmp_path_factory, cell) -> Iterator[Site]:
    """A service, a worker, and a cell `c1` on the wires."""
    with ExitStack() as stack:
        station = Emulator("geocom_station", "--world", cell.world.address)
        stack.callback(station.close)
        running = stack.enter_context(installation(tmp_path_factory.mktemp("site")))
        described = {
            "name": "c1",
            "robot": {"model": "ur10e", "driver": "ur_rtde", "address": cell.address},
            "tracker": {"driver": "geocom", "address": station.ready["port"]},
            "limits": {"speed_deg_s": SPEED_DEG_S},
        }
        assert running.post("/cells", described).status_code == 201
        yield running


def in_motion(site: Site, cell: Cell) -> int:
    """A campaign in the middle of a motion of several seconds."""
    cell.restore()
    cell.world.ask("set", name="time_scale", value=1.0)
    site.post("/cells/c1/arm")
    number = site.start_campaign(FAR)
    wait_until(cell.world.moving)
    reached = cell.world.joints()[0]
    wait_until(lambda: abs(cell.world.joints()[0] - reached) > AT_FULL_SPEED)
    return number


def seconds_to_rest(cell: Cell, since_s: float) -> float:
    wait_until(cell.world.at_rest)
    return cell.world.ask("robot")["time_s"] - since_s


def test_both_devices_are_found(site):
    found = site.post("/cells/c1/check").json()
    assert found["ok"] is True, found
    assert "6 joints" in found["robot"]["detail"]


def test_a_short_campaign_is_measured_and_identified(site, cell):
    site.post("/cells/c1/arm")
    number = site.start_campaign(POSES)
    shown = site.await_state(number, *ENDED, "paused")
    assert shown["state"] == "finished", shown
    rows = site.get(f"/campaigns/{number}/measurements").json()["rows"]
    assert [row["pose"] for row in rows] == list(range(POSES))
    assert {row["attempt"] for row in rows} == {1}
    for row in rows:
        joints = [math.radians(row[f"j{n}_deg"]) for n in range(1, 7)]
        truth = cell.world.ask("truth", joints=joints)["position"]
        assert math.dist(truth, [row[f"{axis}_mm"] / 1e3 for axis in "xyz"]) < NOISE
    residuals = site.get(f"/campaigns/{number}/identification").json()["residuals"]
    assert residuals["fit"]["position_rms_mm"] < 0.2 * residuals["before"]["position_rms_mm"]


def test_an_abort_stops_the_arm_at_once(site, cell):
    took_s = []
    for _ in range(3):
        number = in_motion(site, cell)
        asked_s = cell.world.ask("robot")["time_s"]
        assert site.post(f"/campaigns/{number}/abort").status_code == 200
        took_s.append(seconds_to_rest(cell, asked_s))
        site.await_state(number, "aborted")
    # This machine may be busy with something else at one of them.
    assert min(took_s) < ABORT_S, took_s
    assert max(took_s) < 5 * ABORT_S, took_s


def test_the_arm_stops_when_the_worker_is_killed(site, cell):
    number = in_motion(site, cell)
    killed_s = cell.world.ask("robot")["time_s"]
    site._processes[-1].kill()
    took_s = seconds_to_rest(cell, killed_s)
    assert took_s < WORKER_LOST_S
    cell.world.ask("set", name="time_scale", value=20.0)
    site.start_worker()
    site.await_done(number, len(FAR))

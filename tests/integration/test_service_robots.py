"""Robots without a controller of their own here go the whole way through the mock drivers."""

import re
import signal
import subprocess
import sys

import pytest
from service_cell import ENDED, ROOT, emulated_world, installation

COUNT, TARGETS = 30, 4
ENTRY = "from service.cli import main; main()"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    with installation(tmp_path_factory.mktemp("site")) as running:
        yield running


def describe(site, name: str, model: str, robot: tuple[str, str], tracker: tuple[str, str]) -> None:
    cell = {
        "name": name,
        "robot": {"model": model, "driver": robot[0], "address": robot[1]},
        "tracker": {"driver": tracker[0], "address": tracker[1]},
        # A SCARA reaches below its own foot.
        "limits": {"floor_mm": None},
    }
    assert site.post("/cells", cell).status_code == 201


def finished(site, cell: str, kind: str, poses: int) -> int:
    site.post(f"/cells/{cell}/arm")
    number = site.start_campaign(poses, cell, kind=kind)
    shown = site.await_state(number, *ENDED, "paused")
    assert shown["state"] == "finished", shown
    return number


@pytest.mark.parametrize("model", ["abb_irb910sc", "kuka_iiwa14"])
def test_arms_of_four_and_seven_joints_are_calibrated_and_verified(site, tmp_path, model):
    robot = str(ROOT / "robocal" / "robots" / f"{model}.yaml")
    with emulated_world(tmp_path, robot=robot, start_joints_deg=None) as world:
        mock = ("mock", world.address)
        describe(site, model, model, mock, mock)
        number = finished(site, model, "calibrate", COUNT)
        residuals = site.get(f"/campaigns/{number}/identification").json()["residuals"]
        before = residuals["before"]["position_rms_mm"]
        assert residuals["held_out"]["position_rms_mm"] < 0.3 * before
        number = finished(site, model, "verify", TARGETS)
        found = site.get(f"/campaigns/{number}/verification").json()
        assert found["after"]["position_rms_mm"] < 0.3 * found["before"]["position_rms_mm"]


@pytest.mark.parametrize("robot", ["ur10e", "abb_irb910sc"])
def test_the_emulated_cell_says_how_to_reach_it_and_ends_on_ctrl_c(site, robot):
    with subprocess.Popen(
        [sys.executable, "-c", ENTRY, "emulate", "--robot", robot, "--time-scale", "20"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    ) as emulate:
        devices = {}
        for line in emulate.stdout:
            if "Ctrl+C" in line:
                break
            found = re.match(r"(robot|tracker): +driver (\S+), address (\S+)$", line)
            if found:
                devices[found[1]] = (found[2], found[3])
        describe(site, f"emulated-{robot}", robot, devices["robot"], devices["tracker"])
        check = site.post(f"/cells/emulated-{robot}/check").json()
        emulate.send_signal(signal.SIGINT)
        assert emulate.wait(20) == 0
        assert emulate.stderr.read() == ""
    assert check["ok"] is True, check

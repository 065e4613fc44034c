"""The emulated stage: needles sit in cups, and real drivers read what the stage truly is."""

import json
import math
import os
from contextlib import closing

import numpy as np
import pytest
from stage_hands import cup_in_master, in_slave

from drivers.registry import open_robot, open_stage_sensor
from robocal.base_calibration.arm import Arm
from robocal.kinematics.model import KinematicModel
from robocal.robots.library import load_robot
from service.base_calibrations.models import NewBaseCalibration
from service.emulated_stage import MASTER, NEEDLES_MM, SLAVE, EmulatedStage, StageHands

SEATED = 0.15e-3
"""Five standard deviations of a needle's seat [m]."""
PLACES = [
    ("master", "rod", {"slide_mm": 0, "rod_angle_deg": 20, "rod_length_mm": 350}),
    ("master", "slide", {}),
    ("slave", "rod", {"slide_mm": 1500, "rod_angle_deg": -30, "rod_length_mm": 300}),
    ("slave", "slide", {"slide_mm": 1450}),
]


@pytest.fixture(scope="module")
def running():
    with EmulatedStage(3) as addresses, closing(StageHands(addresses.stage_world)) as hands:
        yield addresses, hands


def needle(robot: str, joints: tuple[float, ...]) -> np.ndarray:
    """Tip in the robot's base by the service's own kinematics."""
    described = load_robot(robot)
    geometry = described.geometry
    tool = np.concatenate([np.array(NEEDLES_MM[robot]) * 1e-3, np.zeros(3)])
    model = KinematicModel(
        geometry.links, geometry.prismatic, tool=tool, mount=geometry.mount, flange=geometry.flange
    )
    return Arm(model, described.limits).needle_poses(np.array([joints]))[0, :3, 3]


@pytest.mark.parametrize(("role", "cup", "about"), PLACES)
def test_a_needle_sits_in_the_cup_by_the_joints_that_its_driver_reads(running, role, cup, about):
    addresses, hands = running
    assert hands.touch(role, cup, **about)["ok"]
    truth = hands.ask("truth")
    model, wire = (MASTER, addresses.master) if role == "master" else (SLAVE, addresses.slave)
    with closing(open_robot(wire.driver, wire.address, load_robot(model).n_joints)) as robot:
        robot.connect()
        tip = needle(model, robot.state().joints)
    place = cup_in_master(truth, cup)
    wanted = place if role == "master" else in_slave(truth, place)
    assert np.linalg.norm(tip - wanted) < SEATED


def test_the_sensors_read_the_stage_through_their_own_wires(running):
    addresses, hands = running
    assert hands.touch("master", "rod", slide_mm=30, rod_angle_deg=-15, rod_length_mm=300)["ok"]
    state = hands.ask("truth")["state"]
    near = {"slide": 0.3e-3, "rod_angle": 0.5e-3, "rod_length": 0.2e-3}
    for name, wire in addresses.sensors.items():
        with closing(open_stage_sensor(wire.driver, wire.address, name)) as sensor:
            sensor.connect()
            assert sensor.read().value == pytest.approx(state[name], abs=near[name])


def test_a_part_that_stays_clamped_is_not_moved(running):
    _, hands = running
    hands.touch("master", "rod", slide_mm=60, rod_angle_deg=10, rod_length_mm=320)
    before = hands.ask("truth")["state"]
    hands.touch("master", "rod", rod_angle_deg=-20)
    after = hands.ask("truth")["state"]
    assert after["slide"] == before["slide"]
    assert after["rod_length"] == before["rod_length"]
    assert after["rod_angle"] == pytest.approx(math.radians(-20), abs=6e-3)


def test_hidden_faults_part_the_cup_from_what_the_sensors_say(running):
    _, hands = running
    assert hands.ask("faults", faults={"squareness_mrad": 5.0, "rod_zero_mm": 2.0})["ok"]
    reply = hands.touch("master", "rod", slide_mm=0, rod_angle_deg=0, rod_length_mm=400)
    truth = hands.ask("truth")
    off = np.array(reply["place"]) - cup_in_master(truth, "rod")
    # The rod points back along the guide: tilting it about the cross axis lifts its end.
    assert abs(off[2]) == pytest.approx(5e-3 * truth["state"]["rod_length"], abs=SEATED)
    read = hands.ask("stage", sensor="rod_length")["value"]
    assert read == pytest.approx(truth["state"]["rod_length"] - 2e-3, abs=0.2e-3)
    assert hands.ask("faults", faults={})["ok"]


def test_a_place_out_of_reach_and_an_unknown_word_are_refused(running):
    _, hands = running
    refused = hands.touch("master", "slide", slide_mm=1500)
    assert (refused["ok"], refused["error"]) == (False, "reach")
    assert "master does not reach" in refused["message"]
    assert not hands.touch("third", "slide")["ok"]
    assert "slide" in hands.ask("stage", sensor="heat")["message"]
    assert "truth" in hands.ask("fly")["message"]
    assert "unknown field heat" in hands.ask("faults", faults={"heat": 1})["message"]


def test_a_person_leads_the_needles_by_lines_of_text(monkeypatch, call):
    lines = "master rod 0 0 350\nslave slide 1500 0 300\nmaster slide 1500 0 300\nhello\n"
    typed, keyboard = os.pipe()
    monkeypatch.setattr("service.emulated_hands.STDIN", typed)
    with os.fdopen(typed), os.fdopen(keyboard, "w") as person:
        person.write(lines)
        person.close()
        status, printed, _ = call("emulate", "--stage")
    assert status == 0
    said = printed.splitlines()[-4:]
    assert said[:2] == [
        "the master's needle sits in the rod cup",
        "the slave's needle sits in the slide cup",
    ]
    assert "does not reach" in said[2]
    assert "five words" in said[3]
    body = json.loads(printed[printed.index("{") : printed.rindex("}") + 1])
    assert NewBaseCalibration.model_validate(body).name == "emulated"

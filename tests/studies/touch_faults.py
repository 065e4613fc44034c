"""Faults of the stage's sensors while a touch of a base calibration is taken.

A touch that is refused must leave nothing behind and must be right when it is taken again after the
fault is over. Values that stand still are left out: a rangefinder, encoder or gauge that repeats
its value cannot be told from one that measures the same again.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, field

from service.emulated_faults import FAULTS, switch
from service.emulated_stage import EmulatedStage, StageAddresses, StageHands
from tests.integration.service_cell import Site
from tests.studies.fault_outcome import LASTING, Outcome

CREATED = 201
IN_A_TOUCH_S = 0.1
"""So long after a touch was asked for a fault begins."""
WRONG_MM, WRONG_RAD = 0.3, 1e-3
"""Ten standard deviations of what a sensor is off; touches lie farther apart."""
LEFT_OUT = {"frozen", "plugged", "none"}
AGAIN = 3
_LASTS = ("unplugged", "wrong_baud")


@dataclass
class Rig:
    """A stage, a person at it, and a base calibration."""

    site: Site
    stage: StageAddresses
    hands: StageHands
    number: int
    touches: int = 0
    pool: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(1))

    def lead(self) -> None:
        """Lead the master's needle to another place than before."""
        self.touches += 1
        step = self.touches % 5
        about = {
            "slide_mm": 40.0 * step,
            "rod_angle_deg": 6.0 * step - 12,
            "rod_length_mm": 300 + 20.0 * step,
        }
        assert self.hands.touch("master", "rod", **about)["ok"]

    def take(self) -> tuple[int, dict]:
        """Ask for a touch."""
        body = {"robot": "master", "cup": "rod"}
        answer = self.site.post(f"/base-calibrations/{self.number}/touches", body)
        return answer.status_code, answer.json()

    def stored(self) -> int:
        """How many touches there are."""
        return len(self.site.get(f"/base-calibrations/{self.number}").json()["touches"])

    def is_true(self, touch: dict) -> bool:
        """Whether it holds what the stage is at."""
        state = self.hands.ask("truth")["state"]
        return (
            abs(touch["slide_mm"] - state["slide"] * 1e3) < WRONG_MM
            and abs(touch["rod_length_mm"] - state["rod_length"] * 1e3) < WRONG_MM
            and abs(math.radians(touch["rod_angle_deg"]) - state["rod_angle"]) < WRONG_RAD
        )


def tried(rig: Rig, sensor: str, fault: str, replies: int) -> Outcome:
    """Take one touch through a fault, and once more after it where it was refused."""
    rig.lead()
    before = rig.stored()
    asked = rig.pool.submit(rig.take)
    time.sleep(IN_A_TOUCH_S)
    lasts = fault in _LASTS
    switch(rig.stage.wires, [sensor, fault, *([] if lasts else [f"replies={replies}"])])
    status, answer = asked.result()
    word, sentence = "recovered", ""
    if status == CREATED and replies == LASTING:
        # The touch was through before the fault; the next one meets it.
        rig.lead()
        before += 1
        status, answer = rig.take()
    left = rig.stored() - before - int(status == CREATED)
    switch(rig.stage.wires, [sensor, "plugged" if fault == "unplugged" else "none"])
    if status != CREATED:
        word, sentence = "resumed", str(answer["detail"])
        status, answer = taken_again(rig)
    taken = status == CREATED
    return Outcome(
        word if taken else "refused",
        sentence if taken else str(answer["detail"]),
        int(not taken),
        left + int(taken and not rig.is_true(answer)),
        0,
    )


def taken_again(rig: Rig) -> tuple[int, dict]:
    """Take the touch after the fault as a person does: again, where the robot was not read."""
    for _ in range(AGAIN):
        status, answer = rig.take()
        if status == CREATED:
            break
    return status, answer


def outcomes(
    site: Site, devices: list[str] | None, faults: list[str] | None
) -> Iterator[tuple[str, str, str, Outcome]]:
    """Every fault of every sensor: name, fault, how long, what became of it."""
    if devices and not {"dimetix", "lika", "magnescale"} & set(devices):
        return
    with EmulatedStage(3) as stage, closing(StageHands(stage.stage_world)) as hands:
        answer = site.post("/base-calibrations", stage.request("faults"))
        assert answer.status_code == CREATED, answer.text
        rig = Rig(site, stage, hands, answer.json()["id"])
        for sensor, wire in stage.sensors.items():
            if devices and wire.driver not in devices:
                continue
            for fault in FAULTS[wire.driver]:
                if fault in LEFT_OUT or (faults and fault not in faults):
                    continue
                once = [] if fault in _LASTS else [("once", 1)]
                for much, replies in (*once, ("lasting", LASTING)):
                    outcome = tried(rig, sensor, fault, replies)
                    yield f"{wire.driver} ({sensor})", fault, much, outcome
        rig.pool.shutdown()

"""Hide an effect in an emulated cell, and let the service find it: campaign, diagnosis, follow-up.

All goes through the REST API; the truth is opened when the last verdict is there. Drawn are effects
that a cell with one payload and no probe shows. What goes with time is not drawn: the emulated
clock, which runs many times too fast, runs on while the service computes.
"""

import io
import os
import zipfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from drivers.emulators.blind_case import Options, draw_case
from drivers.emulators.campaign_draw import Size
from drivers.emulators.effects import LISTED
from drivers.emulators.robot_file import read_robot
from drivers.emulators.stance import Circumstances
from drivers.emulators.true_cell import TrueCell
from drivers.emulators.visibility import Sigma, difference, geometry_basis, visibility
from drivers.emulators.world_config import read_config
from robocal.formats.bundle import read_bundle
from robocal.identification.prepared import prepare
from robocal.measurements import MeasurementSet
from tests.blind.intervals import Rate, mean, rate
from tests.blind.rates import VISIBLE, Line, is_settled, is_unsure, top_is, top_states
from tests.blind.trials import ROOT, Order, Place, Trial
from tests.blind.truth import HiddenEffect, Truth
from tests.blind.verdict import Verdict, verdict_of
from tests.credentials import KEY, SETTING
from tests.integration.service_cell import ENDED, Site, emulated_world, installation

EFFECTS = (
    "joint_compliance",
    "base_compliance",
    "link_bending",
    "gear_harmonic",
    "encoder_gain",
    "joint_coupling",
    "backlash",
    "load_backlash",
    "base_step",
    "tool_step",
    "encoder_step",
)
MODELS = ("ur10e", "ur5e")
POSES, SIZE = 30, 0.5
"""Few poses and half the usual size of effects, so that follow-ups have something to settle."""
ROUND, ROUNDS = 10, 3
"""Poses of a follow-up's round, and rounds at most."""
TIME_SCALE = 100
PERSONS = 20
"""Times that somebody looks after a campaign that has paused."""
SIGMA_MM, SIGMA_MRAD = 0.03, 0.05
STEP_WITHIN = (0.2, 0.8)
"""Share of the campaign's readings after which a step may come; [1]"""


@dataclass(frozen=True)
class CellTrial(Trial):
    """A trial with what the first campaign alone led to."""

    first: Verdict
    rounds: int
    """Diagnoses of the follow-up; 0 where none was to be asked for."""


def cell_rates(trials: list[CellTrial]) -> list[Line]:
    """One effect in a cell; the verdict of the last diagnosis counts."""
    hidden = [t.truth.main[0] for t in trials]
    seen = [t for t, h in zip(trials, hidden, strict=True) if h.strength >= VISIBLE]
    found = [t for t in trials if t.verdict.alarmed]
    unsure = [t for t in trials if is_unsure(t.first)]
    right = rate([top_is(t, t.truth.main[0]) for t in found])
    stated = rate([top_states(t, t.truth.main[0]) for t in found])
    return [
        Line("cell, Lambda >= 5.5: detected", rate([t.verdict.alarmed for t in seen])),
        Line("cell, detected: named right with joint", right),
        Line("... in the stated 95 % set", stated),
        Line("ambiguous after the campaign", Rate(len(unsure), len(trials))),
        Line("... settled by the follow-up", rate([is_settled(t) for t in unsure])),
        Line("rounds of a follow-up", mean([float(t.rounds) for t in trials if t.rounds])),
    ]


def run_cells(folder: Path, order: Order) -> list[CellTrial]:
    """One installation serves all cells, one after the other."""
    os.environ.setdefault(SETTING, KEY)
    folder.mkdir(parents=True, exist_ok=True)
    with installation(folder) as site:
        return [_run(site, folder / f"{k:04d}", order.seed, k) for k in range(order.trials)]


def _run(site: Site, folder: Path, seed: int, index: int) -> CellTrial:
    folder.mkdir()
    draw = np.random.default_rng([seed, index])
    model = str(draw.choice(MODELS))
    entries = _drawn(model, str(draw.choice(EFFECTS)), seed, index, draw)
    config = {
        "robot": str(ROOT / "robocal" / "robots" / f"{model}.yaml"),
        "seed": int(draw.integers(2**31)),
        "time_scale": TIME_SCALE,
        "noise": {"position_mm": SIGMA_MM, "ppm": 0.0, "orientation_mrad": SIGMA_MRAD},
        "effects": [entries],
    }
    cell = f"cell{index}"
    with emulated_world(folder, **config) as world:
        _make_cell(site, cell, model, world.address)
        first = _campaign(site, cell, {"kind": "calibrate", "poses": POSES})
        before = _verdict(site, first)
        last, rounds = _follow(site, cell, first)
        after = before if rounds == 0 else _verdict(site, last)
        told = world.ask("truth")["effects"]
    truth = _truth(folder / "world.json", _measured(site, first, folder / "bundle"), entries)
    assert len(told) == len(truth.effects)
    place = Place(folder, folder / "world.json", folder)
    return CellTrial(place, truth, after, before, rounds)


def _drawn(
    model: str, effect: str, seed: int, index: int, draw: np.random.Generator
) -> dict[str, Any]:
    """An effect; a step comes after some of the readings, whatever the clock says."""
    robot = read_robot(ROOT / "robocal" / "robots" / f"{model}.yaml")
    options = Options(seed, index, "one", size=Size(POSES, 2, 2), factor=SIZE, effect=effect)
    entries = dict(draw_case(robot, options).hidden[0].entries)
    if entries.pop("at_s", None) is not None:
        entries["after_readings"] = round(float(draw.uniform(*STEP_WITHIN)) * POSES)
    finite = {k: v for k, v in entries.items() if not (isinstance(v, float) and np.isinf(v))}
    return {"effect": effect, **finite}


def _make_cell(site: Site, cell: str, model: str, address: str) -> None:
    tracker = {"sigma_mm": SIGMA_MM, "sigma_ppm": 0.0, "sigma_mrad": SIGMA_MRAD}
    mock = {"driver": "mock", "address": address}
    answer = site.post(
        "/cells", {"name": cell, "robot": {"model": model, **mock}, "tracker": {**tracker, **mock}}
    )
    assert answer.status_code == 201, answer.text


def _campaign(site: Site, cell: str, wish: dict[str, Any]) -> int:
    assert site.post(f"/cells/{cell}/arm").status_code == 200
    answer = site.post("/campaigns", {"cell": cell, "settle_s": 0.2, **wish})
    assert answer.status_code == 202, answer.text
    number: int = answer.json()["id"]
    for _ in range(PERSONS):
        shown = site.await_state(number, *ENDED, "paused")
        if shown["state"] != "paused":
            break
        # On a busy machine the fast clock looks like a robot that stands still.
        assert site.post(f"/campaigns/{number}/resume").is_success
    assert shown["state"] == "finished", shown
    return number


def _follow(site: Site, cell: str, first: int) -> tuple[int, int]:
    """The follow-up that the page offers with one click; its number and its diagnoses."""
    if site.get(f"/campaigns/{first}/diagnosis").json()["next_poses"] is None:
        return first, 0
    wish = {"kind": "follow_up", "follows": first, "poses": ROUND, "rounds": ROUNDS}
    number = _campaign(site, cell, wish)
    jobs = site.rows(f"SELECT kind FROM job WHERE campaign={number}")
    return number, [kind for (kind,) in jobs].count("diagnose")


def _verdict(site: Site, number: int) -> Verdict:
    answer = site.get(f"/campaigns/{number}/diagnosis")
    assert answer.status_code == 200, answer.text
    return verdict_of(answer.json())


def _measured(site: Site, number: int, folder: Path) -> MeasurementSet:
    packed = site.get(f"/campaigns/{number}/bundle").content
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        archive.extractall(folder)
    bundle = read_bundle(folder)
    return prepare(bundle, bundle.choices).rows


def _truth(world: Path, rows: MeasurementSet, entries: dict[str, Any]) -> Truth:
    """What was hidden, and how much of it the fitted rows of the first campaign show."""
    hidden = TrueCell(read_config(world)).hidden()
    fitted, now = ~rows.held_out, _circumstances(rows)
    sigma = Sigma(SIGMA_MM * 1e-3, SIGMA_MRAD * 1e-3 if rows.has_orientation.all() else None)
    basis = geometry_basis(hidden, rows.joints[fitted], sigma)
    bare = replace(hidden, effects=())
    seen = visibility(difference(hidden, bare, rows.joints, now, sigma), basis, fitted)
    effect = HiddenEffect(
        effect=entries["effect"],
        joint=entries.get("joint"),
        order=entries.get("order"),
        driven_by=entries.get("driven_by"),
        listed=entries["effect"] in LISTED,
        main=True,
        snr=seen.snr,
        strength=seen.strength,
    )
    return Truth("cell", (effect,), (), (), None, (), SIGMA_MM * np.sqrt(3.0))


def _circumstances(rows: MeasurementSet) -> Circumstances:
    """Of rows in the order measured, as far as the effects drawn here depend on them."""
    n = len(rows)
    nothing = np.zeros(n)
    return Circumstances(
        time_s=nothing,
        temperature_degc=nothing,
        payload_kg=nothing,
        readings=np.arange(n, dtype=float),
        last_motion=rows.approach,
        last_move=np.zeros_like(rows.joints),
        speed=nothing,
        settled_s=nothing,
        stops=rows.joints,
        stop=np.arange(n),
    )

"""Hidden effects are found in bundles that the emulated world wrote, and told in three files."""

import csv
import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.blind.truth import Truth, read_truth
from tests.blind.verdict import Verdict, read_verdict
from tests.robocal.diagnosis.hidden_cases import write_cases

SIZE = "3"
SIZES = {"instrument_angle": "12"}
"""A circle error of the usual size is below what 120 poses show."""
HIDDEN = (
    "joint_compliance",
    "payload_compliance",
    "link_bending",
    "base_compliance",
    "gear_harmonic",
    "encoder_gain",
    "joint_coupling",
    "backlash",
    "load_backlash",
    "settling",
    "thermal_expansion",
    "joint_thermal_drift",
    "warm_up",
    "base_drift",
    "base_step",
    "tool_step",
    "encoder_step",
    "instrument_angle",
)
FIELDS = {
    "verdict",
    "lack_of_fit",
    "effects",
    "data_faults",
    "depends_on",
    "gain",
    "noise_floor_mm",
    "next_poses",
}
EFFECT_FIELDS = {
    "effect",
    "probability",
    "parameters",
    "explained_fraction",
    "confusable_with",
    "gain",
}
GAIN_FIELDS = {"held_out_rms_before_mm", "held_out_rms_after_mm", "reduction", "ci95"}


@dataclass(frozen=True)
class Case:
    """A bundle with something hidden, and what was said of it."""

    bundle: Path
    truth: Truth
    out: Path
    verdict: Verdict


def write_hidden(folder: Path, kind: str, size: str, effects: tuple[str, ...]) -> None:
    """A bundle for every effect."""
    kinds = ["--kind", kind, "--seed", "7", "--size", size, "--count", str(max(len(effects), 1))]
    chosen = [part for effect in effects for part in ("--effect", effect)]
    write_cases(folder, *kinds, *chosen)


@pytest.fixture(scope="session")
def hidden_cases(tmp_path_factory) -> dict[str, tuple[Path, Truth]]:
    """For every effect a bundle where it is hidden, and the truth; `clean` holds none."""
    cases = {}
    plain = tuple(effect for effect in HIDDEN if effect not in SIZES)
    orders = [("one", SIZE, plain), ("clean", SIZE, ())]
    orders += [("one", size, (effect,)) for effect, size in SIZES.items()]
    for kind, size, effects in orders:
        folder = tmp_path_factory.mktemp(kind)
        write_hidden(folder, kind, size, effects)
        for index, effect in enumerate(effects or ("clean",)):
            truth = read_truth(folder / "truth" / f"{index:04d}.json")
            cases[effect] = (folder / f"{index:04d}", truth)
    return cases


@pytest.fixture(scope="session")
def results() -> dict[str, Path]:
    """Where the diagnoses lie that were made so far."""
    return {}


@pytest.fixture
def diagnosed(call, hidden_cases, results, tmp_path_factory) -> Callable[[str], Case]:
    """Diagnose the bundle of an effect, once for all tests; nobody changes what it wrote."""

    def diagnose(effect: str) -> Case:
        bundle, truth = hidden_cases[effect]
        if effect not in results:
            out = tmp_path_factory.mktemp(f"diagnosed_{effect}")
            status, _, complaint = call("diagnose", bundle, "--out", out)
            assert (status, complaint) == (0, "")
            results[effect] = out
        return Case(bundle, truth, results[effect], read_verdict(results[effect]))

    return diagnose


@pytest.mark.parametrize("effect", HIDDEN)
def test_an_effect_injected_alone_is_named_first_with_its_joint(diagnosed, effect):
    case = diagnosed(effect)
    assert case.verdict.named[0].cause.is_(case.truth.main[0]), case.verdict


def test_clean_data_name_nothing(diagnosed):
    verdict = diagnosed("clean").verdict
    assert verdict.word == "model_adequate"
    assert not verdict.named


def columns(path: Path) -> dict[str, np.ndarray]:
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def test_predict_uses_the_effects_of_the_written_model(call, diagnosed, tmp_path):
    """Held-out rows, predicted by a second program run from model.yaml alone."""
    case = diagnosed("payload_compliance")
    model, bundle = case.out / "model.yaml", case.bundle
    assert yaml.safe_load(model.read_text())["effects"]
    out = tmp_path / "poses.csv"
    status, _, complaint = call("predict", model, bundle / "measurements.csv", "--out", out)
    assert status == 0
    assert "the quaternions are the flange's" in complaint
    measured, predicted = columns(bundle / "measurements.csv"), columns(out)
    check = measured["split"] == "check"
    miss = np.stack([
        measured[name].astype(float) - predicted[name].astype(float)
        for name in ("x_mm", "y_mm", "z_mm")
    ])[:, check]
    rms = float(np.sqrt((miss**2).sum(axis=0).mean()))
    gain = json.loads((case.out / "diagnosis.json").read_text())["gain"]
    # poses.csv rounds to a hundredth of a micrometre.
    assert rms == pytest.approx(gain["held_out_rms_after_mm"], rel=1e-4)
    assert rms < 1.3 * case.truth.noise_floor_mm < gain["held_out_rms_before_mm"]


def test_the_document_has_the_shape_of_the_contract(diagnosed):
    document = json.loads((diagnosed("gear_harmonic").out / "diagnosis.json").read_text())
    assert document.keys() >= FIELDS
    assert document["lack_of_fit"].keys() == {"statistic", "p_value"}
    assert document["gain"].keys() >= GAIN_FIELDS
    for entry in document["effects"]:
        assert entry.keys() >= EFFECT_FIELDS
        assert entry["gain"].keys() >= GAIN_FIELDS
        assert entry["blocked_gain"].keys() == {"reduction", "ci95"}
        assert 0.0 <= entry["probability"] <= 1.0
        assert all(value.keys() >= {"value", "std"} for value in entry["parameters"].values())


class Page(HTMLParser):
    """Collects what a page would load from elsewhere."""

    def __init__(self) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.tags: set[str] = set()

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        self.loads += [value for name, value in attrs if name in {"src", "href"} and value]


def test_the_report_is_one_file_that_loads_nothing(diagnosed):
    case = diagnosed("backlash")
    text = (case.out / "report.html").read_text(encoding="utf-8")
    page = Page()
    page.feed(text)
    assert all(target.startswith(("#", "data:")) for target in page.loads)
    assert not re.search(r"url\((?!['\"]?data:)", text)
    assert "svg" in page.tags
    assert f"J{case.truth.main[0].joint}" in text


def test_compensated_joints_bring_the_target_to_the_wanted_pose_under_load(
    call, diagnosed, tmp_path
):
    """Judged by `predict` from the same model; the geometry alone would miss by far more.

    The rows are positions, so the orientations are the flange's.
    """
    case = diagnosed("payload_compliance")
    model, bundle = case.out / "model.yaml", case.bundle
    poses, back = tmp_path / "poses.csv", tmp_path / "back.csv"
    of_flange = ("--orientation-of", "flange")
    readings = bundle / "measurements.csv"
    assert call("predict", model, readings, "--out", poses, *of_flange)[0] == 0
    measured, predicted = columns(bundle / "measurements.csv"), columns(poses)
    loaded = np.flatnonzero(measured["payload_kg"].astype(float) > 3)[:10]
    joints = [f"j{joint}_deg" for joint in range(1, 7)]
    place = ["x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz"]
    names = [*joints, *place, "payload_kg"]
    lines = [",".join(names)]
    for row in loaded:
        # A millimetre to the side, so that the joints have to move.
        cells = [measured[n][row] for n in joints]
        cells += [str(float(predicted["x_mm"][row]) + 1.0), *(predicted[n][row] for n in place[1:])]
        lines.append(",".join([*cells, measured["payload_kg"][row]]))
    targets, found = tmp_path / "targets.csv", tmp_path / "found.csv"
    targets.write_text("\n".join(lines) + "\n")
    assert call("compensate", model, targets, "--out", found, *of_flange)[0] == 0
    compensated = columns(found)
    # Some of the measured poses lie near a singularity and are named so.
    good = compensated["status"] == "reached"
    assert good.sum() >= 6
    compensated = {name: cells[good] for name, cells in compensated.items()}
    kept = [*joints, "payload_kg"]
    rows = zip(*(compensated[n] for n in kept), strict=True)
    poses.write_text("\n".join([",".join(kept), *(",".join(row) for row in rows)]) + "\n")
    assert call("predict", model, poses, "--out", back)[0] == 0
    reached, wanted = columns(back), columns(targets)
    for name in place[:3]:
        miss = reached[name].astype(float) - wanted[name][good].astype(float)
        assert np.abs(miss).max() < 1e-4

"""The whole evaluation: what it states, how often that holds, and when it says that it does not."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robocal.formats.identification_json import identification_document
from robocal.formats.uncertainty_json import uncertainty_document
from robocal.identification.identify import identify
from robocal.instrument import InstrumentNoise
from robocal.kinematics.forward import forward_kinematics
from robocal.uncertainty.budget import Budget, ReadingsBy
from robocal.uncertainty.evaluation import Settings, evaluate
from robocal.uncertainty.fitted_rows import fitted_rows
from robocal.uncertainty.repeats import scatter_of_repeats
from robocal.uncertainty.sources import sources_of
from robocal.uncertainty.tool_pose import tool_uncertainty
from robocal.uncertainty.verdict import judge_intervals
from robocal.uncertainty.workspace_map import map_workspace
from tests.robocal.uncertainty.campaign_bundles import Campaign, campaign
from tests.studies.coverage import run

FAST = Settings(draws=2000)


def evaluated(one: Campaign, settings: Settings = FAST):
    q = one.bundle.measurements.joints[:12]
    return evaluate(one.bundle, one.fit.result, q, settings)


def held(one: Campaign) -> bool | None:
    """Whether the report says that its intervals hold."""
    return judge_intervals(one.fit, scatter_of_repeats(one.fit)).hold


def test_the_law_of_propagation_is_validated_and_refits_agree(tmp_path):
    """400 refits know a standard deviation to 3.5 %; four of these."""
    found = evaluated(campaign(tmp_path), Settings(refits=400))
    assert found.check.sampled.stable
    assert found.check.agreement.validated.all()
    assert not found.check.by_refits
    assert found.refits is not None
    assert found.refits.n_unsettled == 0
    free = found.result.free
    ratio = found.refits.std[free] / found.parameters.std[free]
    assert np.abs(ratio - 1).max() < 0.15
    bias = np.abs(found.refits.bias[free]) / found.parameters.std[free]
    assert bias.max() < 5 / np.sqrt(400)


def test_parallel_axes_make_the_draws_refits_and_the_tool_stays_known(tmp_path):
    """A SCARA's base and tool heights are open by metres; the tool's position is not."""
    found = evaluated(campaign(tmp_path, "abb_irb910sc"), Settings(draws=2000))
    assert found.check.by_refits
    drawn = found.check.sampled.std.reshape(-1, 3)
    stated = found.tool.position_std[found.check.poses]
    np.testing.assert_allclose(drawn, stated, rtol=0.12)


@pytest.mark.parametrize("seed", [3, 7, 10])
def test_no_source_takes_less_than_nothing_where_open_frames_cancel_at_the_tool(tmp_path, seed):
    """A SCARA's positions leave its frames open by metres: their rounding is no share."""
    one = campaign(tmp_path, "abb_irb910sc", seed, full_pose=False)
    sources = sources_of(one.fit, scatter_of_repeats(one.fit))
    q = one.bundle.measurements.joints[:12]
    tool = tool_uncertainty(one.fit.result.model, sources, q)
    assert (tool.shares >= 0.0).all()
    np.testing.assert_allclose(tool.shares.sum(axis=1), 1.0)
    assert np.isfinite(tool.position_std).all()


def test_everything_the_report_tells_is_plain_json(tmp_path):
    one = campaign(tmp_path, rows=25, repeats=2)
    found = evaluated(one, Settings(draws=2000, refits=40))
    workspace = map_workspace(one.bundle.robot, one.fit.result.model, found.sources, 1, 300)
    lines = one.bundle.measurements.lines[:12]
    document = uncertainty_document(found, lines, workspace)
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    shares = [row["share"] for row in document["budget"]]
    assert sum(shares) == pytest.approx(1.0)
    assert [row["line"] for row in document["poses"]] == lines.tolist()
    assert len(document["parameters"]) == len(one.fit.free)


def test_the_same_seed_tells_the_same(tmp_path):
    one = campaign(tmp_path)
    lines = one.bundle.measurements.lines[:12]
    first, second = (
        uncertainty_document(evaluated(one, Settings(draws=2000, refits=40)), lines)
        for _ in range(2)
    )
    assert first == second


def test_the_map_knows_the_workspace_and_its_worst_places(tmp_path):
    """Every cube's figures are those of the poses in it; a longer arm is known less well."""
    one = campaign(tmp_path)
    sources = sources_of(one.fit, scatter_of_repeats(one.fit))
    found = map_workspace(one.bundle.robot, one.fit.result.model, sources, 1, 500)
    assert found.poses.sum() == 500
    assert (found.mean <= found.largest).all()
    assert (found.mean > 0).all()
    reach = np.linalg.norm(found.centre, axis=1)
    assert reach.max() < 0.29 + 0.31 + 0.07 + 0.2 + np.sqrt(3) * found.edge
    tight = map_workspace(one.bundle.robot, one.fit.result.model, sources[:1], 1, 500)
    assert (tight.mean < found.mean).all()


@pytest.mark.parametrize("full_pose", [True, False])
def test_intervals_hold_the_truth_as_often_as_they_say(full_pose):
    """240 campaigns know a share to 1.4 %; less the luck of the sample, to a few tenths."""
    found = run("staubli_tx60", 240, 1, full_pose=full_pose, wrong=1.0)
    for shares in (found.parameters, found.coordinates, found.balls):
        assert shares.counted.min() > 0.89
        assert shares.error.max() < 0.006
        assert np.abs(shares.corrected - 0.95).max() < 0.015


def test_the_whole_chain_holds_the_truth_of_the_tool(tmp_path):
    """Files, start, outlier test, fit, budget: 15 cells, 6 new poses each, radius and coordinates.

    Errors at the poses of one cell go together; 15 cells know 95 % to about 4 %.
    """
    inside, balls = [], []
    for seed in range(15):
        one = campaign(tmp_path / str(seed), "ur5e", seed, rows=40)
        q = np.random.default_rng(seed).uniform(-2, 2, (6, 6))
        found = evaluate(one.bundle, one.fit.result, q, Settings(draws=200))
        away = forward_kinematics(one.fit.result.model, q)[:, :3, 3] - one.true.poses(q)[:, :3, 3]
        inside.append((np.abs(away) <= 1.96 * found.tool.position_std).mean())
        balls.append((np.linalg.norm(away, axis=1) <= found.tool.radius).mean())
    assert np.mean(inside) == pytest.approx(0.95, abs=0.09)
    assert np.mean(balls) == pytest.approx(0.95, abs=0.1)


def test_sound_campaigns_are_called_sound(tmp_path):
    """The bands err once in a hundred; of eight campaigns one may be doubted."""
    answers = [held(campaign(tmp_path / str(seed), "ur10e", seed)) for seed in range(8)]
    assert answers.count(True) >= 7


@pytest.mark.parametrize("noise", [0.6, 1.5])
def test_a_wrong_statement_of_noise_is_told(noise, tmp_path):
    for seed in range(4):
        one = campaign(tmp_path / str(seed), "ur10e", seed, noise=noise)
        verdict = judge_intervals(one.fit, scatter_of_repeats(one.fit))
        assert verdict.hold is False
        assert "do not hold" in verdict.sentence


def yielding(one: Campaign) -> Campaign:
    """The same readings of an arm that sags by up to 0.1 mm, as no geometry does."""
    rows = one.bundle.measurements
    wave = np.cos(2 * rows.joints[:, 1]) * np.sin(rows.joints[:, 4])
    sag = 1e-4 * np.outer(wave, [0.0, 0.0, 1.0])
    bundle = replace(one.bundle, measurements=replace(rows, position=rows.position + sag))
    return Campaign(bundle, fitted_rows(bundle, identify(bundle)), one.true)


@pytest.mark.parametrize("readings", list(ReadingsBy))
def test_an_effect_that_the_model_lacks_is_told(readings, tmp_path):
    """Also where the noise is taken from repeats: the residuals are larger than their scatter."""
    for seed in range(4):
        one = campaign(
            tmp_path / str(seed), seed=seed, rows=30, repeats=3, budget=Budget(readings=readings)
        )
        assert held(one) is True
        assert held(yielding(one)) is False


def test_scatter_from_repeats_makes_good_a_wrong_statement(tmp_path):
    """Twice the declared noise: told where declared, put right where repeats are believed."""
    declared = campaign(tmp_path / "a", rows=30, repeats=3, noise=2.0)
    assert held(declared) is False
    budget = Budget(readings=ReadingsBy.repeats)
    assert held(campaign(tmp_path / "b", rows=30, repeats=3, noise=2.0, budget=budget)) is True


def test_robot_repeatability_belongs_to_the_statement(tmp_path):
    """A robot that does not come back exactly is stated, or told."""
    noise = InstrumentNoise(1.5e-5, 6e-6, 5e-5, 3e-5)
    one = campaign(tmp_path)
    rows = one.bundle.measurements
    rng = np.random.default_rng(3)
    moved = replace(rows, position=rows.position + 3e-5 * rng.normal(size=rows.position.shape))
    for instrument, expected in ((one.bundle.instrument, False), (noise, True)):
        bundle = replace(one.bundle, measurements=moved, instrument=instrument)
        again = Campaign(bundle, fitted_rows(bundle, identify(bundle)), one.true)
        assert held(again) is expected


def test_errors_that_come_back_at_every_repeat_are_told_though_residuals_look_right(tmp_path):
    """Half of the declared noise, the rest the same at every visit: chi-square is as it should."""
    one = campaign(tmp_path, rows=30, repeats=4, noise=0.5)
    rows = one.bundle.measurements
    rng = np.random.default_rng(2)
    offsets = 2.1e-5 * rng.normal(size=(30, 3))[rows.pose]
    turn = Rotation.from_rotvec(4.3e-5 * rng.normal(size=(30, 3))[rows.pose])
    turned = turn * Rotation.from_quat(np.roll(rows.orientation, -1, axis=1))
    orientation = np.roll(turned.as_quat(), 1, axis=1)
    moved = replace(rows, position=rows.position + offsets, orientation=orientation)
    bundle = replace(one.bundle, measurements=moved)
    again = fitted_rows(bundle, identify(bundle))
    assert again.result.adequacy.adequate
    verdict = judge_intervals(again, scatter_of_repeats(again))
    assert verdict.hold is False
    assert "repeats of the positions" in verdict.sentence


def test_frames_are_as_sure_as_the_identification_says_in_the_axes_it_names(tmp_path):
    """Nothing but the declared readings and the prior: both files tell of the same covariance."""
    one = campaign(tmp_path)
    found = evaluated(one)
    document = uncertainty_document(found, one.bundle.measurements.lines[:12])
    stated = identification_document(found.result)
    own = {row["name"]: row["u"] for row in document["parameters"]}
    for frame in ("base", "tool"):
        names = [f"{frame}_{axis}" for axis in ("x", "y", "z", "yaw", "pitch", "roll")]
        seen = [name in own for name in names]
        assert any(seen)
        beside = np.array(stated[frame]["std"])[seen]
        np.testing.assert_allclose([own[name] for name in names if name in own], beside, rtol=1e-3)
        assert stated[frame]["std_axes"] == document["frame_axes"][frame]
        # A shift along the frame's own axes, seen from its parent, is turned by the frame.
        first = found.result.model.n_parameters - (12 if frame == "base" else 6)
        shifts = slice(first, first + 3)
        own_axes = found.result.full_covariance()[shifts, shifts]
        R = (found.result.base if frame == "base" else found.result.tool)[:3, :3]
        expected = np.sqrt(np.diag(R @ own_axes @ R.T)) * 1e3
        np.testing.assert_allclose(stated[frame]["std"][:3], expected, rtol=1e-6)

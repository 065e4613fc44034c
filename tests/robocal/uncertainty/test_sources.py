"""Each source of the budget against an experiment of its own."""

from dataclasses import replace

import numpy as np
import pytest

from robocal.errors import NoAnswer
from robocal.formats.bundle import read_bundle
from robocal.identification.identify import identify
from robocal.instrument import InstrumentNoise
from robocal.kinematics.forward import forward_kinematics
from robocal.uncertainty.budget import Budget, ReadingsBy
from robocal.uncertainty.fitted_rows import fitted_rows
from robocal.uncertainty.repeats import scatter_of_repeats
from robocal.uncertainty.sources import TEMPERATURE, Evaluated, sources_of, total_covariance
from robocal.uncertainty.tool_pose import tool_uncertainty
from tests.robocal.uncertainty.campaign_bundles import Campaign, campaign

Q = np.random.default_rng(9).uniform(-1.5, 1.5, (5, 6))


def sources(one: Campaign):
    return sources_of(one.fit, scatter_of_repeats(one.fit))


def tool_std(one: Campaign, name: str) -> np.ndarray:
    """What one source does to the tool's position at `Q` [m]."""
    own = tuple(source for source in sources(one) if source.name == name)
    assert len(own) == 1
    return tool_uncertainty(one.fit.result.model, own, Q).position_std


def refitted(one: Campaign, **measured: np.ndarray) -> np.ndarray:
    """Tool positions at `Q` after identifying other readings of the same campaign."""
    rows = replace(one.bundle.measurements, **measured)
    return forward_kinematics(identify(replace(one.bundle, measurements=rows)).model, Q)[:, :3, 3]


@pytest.mark.parametrize("robot", ["staubli_tx60", "ur10e"])
def test_the_declared_sources_sum_up_to_the_covariance_of_the_fit(robot, tmp_path):
    noise = InstrumentNoise(1.5e-5, 6e-6, 5e-5, 1e-5, 2e-5)
    one = campaign(tmp_path, robot, instrument=noise)
    total = total_covariance(sources(one))[np.ix_(one.fit.free, one.fit.free)]
    own = np.sqrt(np.diag(one.fit.result.covariance))
    np.testing.assert_allclose(np.sqrt(np.diag(total)), own, rtol=1e-4)
    np.testing.assert_allclose(
        total / np.outer(own, own), one.fit.covariance / np.outer(own, own), atol=1e-9
    )


def test_a_scale_error_moves_the_tool_as_far_as_identifying_stretched_readings_does(tmp_path):
    """Whole chain: all readings longer by 20 ppm, identified anew."""
    one = campaign(tmp_path, budget=Budget(scale=20e-6))
    before = refitted(one)
    after = refitted(one, position=one.bundle.measurements.position * (1 + 20e-6))
    moved = np.abs(after - before)
    np.testing.assert_allclose(
        tool_std(one, "instrument, length scale"), moved, rtol=0.02, atol=1e-8
    )


def test_the_targets_error_is_shared_by_the_repeats_of_a_pose(tmp_path):
    """200 campaigns whose every pose has a reflector off its centre, identified anew."""
    target = 2e-5
    noise = InstrumentNoise(1.5e-5, 6e-6, 5e-5, target=target)
    one = campaign(tmp_path, rows=25, repeats=3, budget=Budget(target=target), instrument=noise)
    rng = np.random.default_rng(1)
    rows = one.bundle.measurements
    free, weight = one.fit.free, one.fit.covariance
    J = _position_jacobian(one)
    # One linear step stands for the identification, which takes 0.1 s; exactness is shown above.
    gain = weight @ J.transpose(0, 2, 1).reshape(len(free), -1)
    errors = target * rng.normal(size=(2000, rows.pose.max() + 1, 3))[:, rows.pose]
    scale = one.fit.rows.position_weight[None, :, None] ** 2
    moves = (errors * scale).reshape(2000, -1) @ gain.T
    own = next(source for source in sources(one) if source.name == "target in its nest")
    stated = np.sqrt(np.diag(own.covariance)[free])
    np.testing.assert_allclose(moves.std(axis=0), stated, rtol=0.08)


def _position_jacobian(one: Campaign) -> np.ndarray:
    """Derivative of every row's position by differences: parameter, component, row."""
    model = one.fit.result.model
    columns = []
    for index in one.fit.free:
        step = np.eye(model.n_parameters)[index] * 1e-6
        up, down = (
            forward_kinematics(model.with_vector(model.vector + sign * step), one.fit.rows.joints)
            for sign in (1, -1)
        )
        columns.append((up - down)[:, :3, 3].T / 2e-6)
    return np.array(columns)


def test_warming_moves_the_tool_as_a_longer_robot_does(tmp_path):
    one = campaign(tmp_path, budget=Budget(temperature=2.0, expansion=12e-6))
    model = one.fit.result.model
    longer = model.links.copy()
    longer[:, 1:3] *= 1 + 24e-6
    tool = model.flange.copy()
    tool[:3, 3] *= 1 + 24e-6
    grown = replace(model, links=longer, flange=tool)
    moved = (forward_kinematics(grown, Q) - forward_kinematics(model, Q))[:, :3, 3]
    np.testing.assert_allclose(tool_std(one, TEMPERATURE), np.abs(moved), rtol=1e-4, atol=1e-9)


def test_repeats_bring_their_own_scatter_and_degrees_of_freedom(tmp_path):
    """The noise is twice the declared one; Type A finds it, and t instead of normal."""
    budget = Budget(readings=ReadingsBy.repeats)
    one = campaign(tmp_path, rows=25, repeats=3, noise=2.0, budget=budget)
    found = sources(one)
    own = [source for source in found if source.evaluated is Evaluated.type_a]
    assert [source.nu for source in own] == [150, 150]
    declared = campaign(tmp_path / "b", rows=25, repeats=3, noise=2.0)
    tool = tool_uncertainty(one.fit.result.model, found, Q)
    plain = tool_uncertainty(declared.fit.result.model, sources(declared), Q)
    # 150 degrees of freedom know a standard deviation to 6 %.
    assert (tool.position_std / plain.position_std).mean() == pytest.approx(2.0, rel=0.15)
    assert (tool.nu >= 150).all()
    assert np.isfinite(tool.nu).all()
    assert np.isinf(plain.nu).all()


def test_scatter_from_repeats_needs_repeats(tmp_path):
    one = campaign(tmp_path, budget=Budget(readings=ReadingsBy.repeats))
    with pytest.raises(NoAnswer, match=r"budget\.readings"):
        sources(one)


def test_shares_of_the_tools_variance_sum_up_to_one(tmp_path):
    budget = Budget(target=5e-6, scale=1e-6, temperature=1.0, expansion=12e-6)
    one = campaign(tmp_path, budget=budget)
    tool = tool_uncertainty(one.fit.result.model, sources(one), Q)
    np.testing.assert_allclose(tool.shares.sum(axis=1), 1.0, rtol=1e-12)
    assert (tool.shares >= 0).all()


def test_a_bundles_budget_reaches_the_sources(tmp_path):
    campaign(tmp_path, rows=30)
    stated = (
        "budget: {target_sigma_mm: 0.004, scale_sigma_ppm: 1, temperature_sigma_degc: 2,\n"
        "  expansion_ppm_per_degc: 12}\n"
    )
    file = tmp_path / "campaign.yaml"
    file.write_text(file.read_text() + stated)
    bundle = read_bundle(tmp_path)
    assert bundle.budget == Budget(4e-6, 1e-6, 2.0, 12e-6)
    fit = fitted_rows(bundle, identify(bundle))
    names = [source.name for source in sources_of(fit, scatter_of_repeats(fit))]
    for name in ("target in its nest", "instrument, length scale", TEMPERATURE):
        assert name in names

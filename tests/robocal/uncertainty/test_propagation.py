"""The law of propagation on the GUM's own examples, and beside GTC."""

import warnings
from pathlib import Path

import numpy as np
import pytest
import yaml

from robocal.uncertainty.distributions import ArcSine, Normal, Rectangular
from robocal.uncertainty.propagation import (
    coverage_factor,
    effective_nu,
    propagate,
    propagate_second_order,
)

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    import GTC

GUM = yaml.safe_load((Path(__file__).parents[2] / "reference" / "gum_examples.yaml").read_text())
H1, H2 = GUM["h1"], GUM["h2"]


def gauge_length(x):
    """GUM, H.1.1: l = l_s + d - l_s (delta_alpha theta + alpha_s delta_theta)."""
    standard, difference, d_alpha, mean, cycle, alpha, d_theta = x
    return standard + difference - standard * (d_alpha * (mean + cycle) + alpha * d_theta)


def normal(entry: dict) -> Normal:
    return Normal(entry["estimate"], entry["u"], entry.get("nu", np.inf))


GAUGE = (
    normal(H1["standard"]),
    normal(H1["difference"]),
    normal(H1["expansion_difference"]),
    normal(H1["mean_temperature"]),
    ArcSine(-H1["cycle"]["half_width"], H1["cycle"]["half_width"]),
    Rectangular(H1["expansion"]["low"], H1["expansion"]["high"]),
    normal(H1["temperature_difference"]),
)


def test_the_end_gauge_has_the_length_and_uncertainty_that_the_gum_prints():
    found, printed = propagate(gauge_length, GAUGE), H1["result"]
    assert found.estimate == pytest.approx(printed["length"], abs=0.5)
    assert round(found.std) == printed["u_c"]
    assert int(found.nu) == printed["nu_eff"]
    assert coverage_factor(found.nu, 0.99) == pytest.approx(printed["k99"], abs=0.005)
    assert round(found.expanded(0.99)) == printed["U99"]


def test_the_end_gauge_has_the_second_order_uncertainty_that_the_gum_prints():
    found = propagate_second_order(gauge_length, GAUGE)
    assert round(found.std) == H1["result"]["u_c_second_order"]


def test_gtc_finds_the_same_for_the_end_gauge():
    theirs = gauge_length([
        GTC.ureal(quantity.estimate, quantity.std, quantity.nu) for quantity in GAUGE
    ])
    ours = propagate(gauge_length, GAUGE)
    assert ours.std == pytest.approx(GTC.uncertainty(theirs), rel=1e-9)
    assert ours.nu == pytest.approx(GTC.dof(theirs), rel=1e-6)


def readings() -> np.ndarray:
    """Volts, amperes, radians of five simultaneous sets."""
    milli = np.array(H2["milliamperes"]) * 1e-3
    return np.array([H2["volts"], milli, H2["radians"]])


IMPEDANCE = {
    "resistance": lambda x: x[0] / x[1] * np.cos(x[2]),
    "reactance": lambda x: x[0] / x[1] * np.sin(x[2]),
    "impedance": lambda x: x[0] / x[1],
}


def h2_results():
    """Every result by propagation with the correlation of the five sets."""
    sets = readings()
    u = sets.std(axis=1, ddof=1) / np.sqrt(5)
    inputs = [Normal(mean, std) for mean, std in zip(sets.mean(axis=1), u, strict=True)]
    r = np.corrcoef(sets)
    return {name: propagate(f, inputs, r) for name, f in IMPEDANCE.items()}, r


def test_resistance_and_reactance_come_out_as_the_gum_prints():
    found, r = h2_results()
    for name, result in found.items():
        assert result.estimate == pytest.approx(H2[name]["ohm"], abs=0.0006)
        assert result.std == pytest.approx(H2[name]["u"], abs=0.0006)
    R, X, Z = (found[name] for name in IMPEDANCE)
    printed = H2["result_correlation"]
    for one, other, value in (
        (R, X, printed["RX"]), (R, Z, printed["RZ"]), (X, Z, printed["XZ"])
    ):  # fmt: skip
        covariance = one.contributions @ r @ other.contributions
        assert covariance / (one.std * other.std) == pytest.approx(value, abs=0.0006)


def test_gtc_finds_the_same_for_resistance_and_reactance():
    V, current, phi = GTC.type_a.multi_estimate_real([list(row) for row in readings()])
    theirs = {
        "resistance": V / current * GTC.cos(phi),
        "reactance": V / current * GTC.sin(phi),
        "impedance": V / current,
    }
    found, _ = h2_results()
    for name, result in found.items():
        assert result.std == pytest.approx(GTC.uncertainty(theirs[name]), rel=1e-6)


def test_one_uncertain_source_lends_its_degrees_of_freedom_to_the_sum():
    assert effective_nu(np.array([4.0]), np.array([7.0])) == pytest.approx(7.0)
    assert effective_nu(np.array([4.0, 4.0]), np.array([7.0, 7.0])) == pytest.approx(14.0)
    assert effective_nu(np.array([4.0, 1.0]), np.array([np.inf, np.inf])) == np.inf


@pytest.mark.parametrize(("nu", "k"), [(1, 12.71), (5, 2.57), (50, 2.01), (np.inf, 1.960)])
def test_coverage_factors_are_those_of_gum_table_g2(nu, k):
    assert coverage_factor(nu) == pytest.approx(k, abs=0.005)


def test_degrees_of_freedom_are_cut_to_a_whole_number():
    """GUM, G.4.1: 16.7 counts as 16; rounding errors must not make 15.999999999 of 16."""
    assert coverage_factor(16.7) == coverage_factor(16.0)
    assert coverage_factor(16.0 - 1e-12) == coverage_factor(16.0)

"""The scatter of repeats against the textbook's analysis of variance."""

import numpy as np
import pytest
from scipy import stats

from robocal.uncertainty.repeats import Scatter, scatter_of_repeats
from tests.robocal.uncertainty.campaign_bundles import campaign


def test_the_pooled_scatter_is_the_within_group_variance_of_an_anova(tmp_path):
    """Residuals of a pose about their mean; the joints repeat exactly, so positions will do."""
    one = campaign(tmp_path, rows=20, repeats=4)
    found = scatter_of_repeats(one.fit)
    rows = one.fit.measured
    groups = [rows.position[rows.pose == pose] for pose in np.unique(rows.pose)]
    within = sum(((group - group.mean(axis=0)) ** 2).sum() for group in groups)
    nu = 3 * sum(len(group) - 1 for group in groups)
    assert found.position is not None
    assert found.position.nu == nu
    # Declared deviations differ from row to row by the range, which weighs the means a little.
    assert found.position.std == pytest.approx(np.sqrt(within / nu), rel=1e-4)
    assert found.orientation is not None
    assert found.orientation.std == pytest.approx(5e-5, rel=0.2)


def test_single_visits_say_nothing_of_scatter(tmp_path):
    found = scatter_of_repeats(campaign(tmp_path).fit)
    assert found.position is None
    assert found.orientation is None


@pytest.mark.parametrize(("noise", "contradicts"), [(1.0, False), (1.5, True), (0.6, True)])
def test_repeats_contradict_a_wrong_declaration(noise, contradicts, tmp_path):
    found = scatter_of_repeats(campaign(tmp_path, rows=25, repeats=4, noise=noise).fit)
    assert found.position is not None
    assert found.position.contradicts is contradicts


def test_the_chance_of_a_ratio_is_chi_squares():
    scatter = Scatter(std=1.0, ratio=1.4, nu=30)
    assert scatter.chance == pytest.approx(2 * stats.chi2(30).sf(42.0))

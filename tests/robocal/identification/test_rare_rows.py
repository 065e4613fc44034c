"""What only few of many rows can tell, and what the campaign states, count as they should."""

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from robocal.errors import BadInput
from robocal.formats.bundle import Target, read_bundle
from robocal.frames import xyz_ypr_from_frame
from robocal.identification.observations import REPRESENTATIVES, position_rows
from robocal.identification.priors import Choices
from tests.measured_cell import true_cell, write_bundle
from tests.robocal.identification.cells import measured, with_nests

N = 1200
SIGMA = 1.6e-5


def test_a_few_full_poses_among_many_positions_are_not_lost(tmp_path, identified):
    bundle, _, _ = measured(tmp_path, "ur10e", 3, N, full_pose=True)
    evenly = np.linspace(0, N - 1, REPRESENTATIVES).astype(int)
    missed = np.setdiff1d(np.arange(N), evenly)
    few = np.random.default_rng(0).choice(missed, 6, replace=False)
    rows = bundle.measurements
    orientation = np.full_like(rows.orientation, np.nan)
    orientation[few] = rows.orientation[few]
    result = identified(replace(bundle, measurements=replace(rows, orientation=orientation)))
    assert result.rank == 30
    rejected = {row.line for row in result.rejected}
    assert rejected.isdisjoint(rows.lines[few].tolist())


@pytest.mark.parametrize("rows", [3 * REPRESENTATIVES - 3, 3 * REPRESENTATIVES])
def test_every_nest_is_identified_however_many_rows_there_are(tmp_path, rows, identified):
    bundle, cell, _ = measured(tmp_path, "ur10e", 3, rows, full_pose=False)
    places = np.random.default_rng(4).normal(size=(3, 3)) * 0.08 + [0.0, 0.0, 0.1]
    assert identified(with_nests(bundle, cell, places, 5, SIGMA)).rank == 33


def test_rows_that_stand_for_all_weigh_as_much_and_hold_the_ends_of_every_joint():
    q = np.random.default_rng(1).uniform(-1.0, 1.0, (N, 6))
    q[:, 4] = 0.0
    q[[7, 700], 4] = -0.5, 0.5
    rows = position_rows(q, np.zeros((N, 3)), 1e-3)
    few = rows.representative
    assert len(few) < 1.3 * REPRESENTATIVES
    assert np.sum(few.position_weight**2) == pytest.approx(np.sum(rows.position_weight**2))
    np.testing.assert_array_equal(few.joints.min(axis=0), q.min(axis=0))
    np.testing.assert_array_equal(few.joints.max(axis=0), q.max(axis=0))


@pytest.mark.parametrize("frame", ["base", "tool"])
def test_a_prior_of_a_frame_counts_from_where_the_campaign_states_it(tmp_path, frame, identified):
    cell = true_cell("ur10e", 5)
    write_bundle(tmp_path, "ur10e", cell, 60, 5)
    stated = {"base_guess": cell.true.base, "tool_guess": cell.true.tool}
    bundle = replace(
        read_bundle(tmp_path), **{name: xyz_ypr_from_frame(T) for name, T in stated.items()}
    )
    prior = {f"{frame}_{axis}": 1e-6 for axis in "xyz"}
    result = identified(bundle, choices=Choices(prior_std=prior))
    found, truth = getattr(result, frame), getattr(cell.true, frame)
    assert np.abs(found - truth)[:3, 3].max() < 4e-6
    assert result.adequacy.adequate


def test_link_6_stays_within_its_prior_where_one_nest_is_stated(tmp_path, identified):
    bundle, cell, _ = measured(tmp_path, "ur10e", 4, 123, full_pose=False)
    places = np.random.default_rng(4).normal(size=(3, 3)) * 0.08 + [0.0, 0.0, 0.1]
    bundle = with_nests(bundle, cell, places, 5, SIGMA)
    known = Target(tuple(places[0].tolist()), fixed=False)
    result = identified(replace(bundle, targets={**bundle.targets, "n1": known}))
    assert result.adequacy.adequate
    assert not result.rejected
    moved = (result.model.links - result.nominal.links)[5]
    assert np.all(np.abs(moved) < 3.0 * np.array([5e-3, 1e-3, 1e-3, 5e-3, 5e-3]))


def test_nothing_but_the_answer_is_printed_where_numbers_are_few(tmp_path):
    """LAPACK writes to standard output when it is called with nothing to do."""
    write_bundle(tmp_path, "ur10e", true_cell("ur10e", 3), 12, 3, full_pose=False)
    entry = "from service.cli import main; main()"
    command = [sys.executable, "-c", entry, "identify", tmp_path, "--out", tmp_path / "out"]
    printed = subprocess.run([*command, "--json"], capture_output=True, check=True).stdout
    assert json.loads(printed)["rank"] <= 27


def test_lengths_held_out_where_none_is_fitted_are_refused(tmp_path, identified):
    bundle, _, _ = measured(tmp_path, "ur10e", 3, 60, full_pose=False)
    rows = bundle.measurements
    held_out = np.arange(len(rows)) % 4 == 3
    position = np.where(held_out[:, None], np.nan, rows.position)
    distance = np.where(held_out, 2.0, np.nan)
    lengths = replace(rows, position=position, distance=distance, held_out=held_out)
    with pytest.raises(BadInput, match="line 5: distance_mm is held out, but no row with"):
        identified(replace(bundle, measurements=lengths))


def test_a_nest_of_which_all_rows_are_held_out_is_refused_unless_its_place_is_stated(
    tmp_path, identified
):
    bundle, cell, _ = measured(tmp_path, "ur10e", 3, 80, full_pose=False)
    places = np.random.default_rng(3).normal(size=(3, 3)) * 0.08 + [0.0, 0.0, 0.1]
    bundle = with_nests(bundle, cell, places, 5, SIGMA)
    rows = bundle.measurements
    held_out = np.array([name == "n2" for name in rows.target])
    bundle = replace(bundle, measurements=replace(rows, held_out=held_out))
    line = rows.lines[np.argmax(held_out)]
    with pytest.raises(BadInput, match=f"line {line}: a row of nest 'n2' is held out"):
        identified(bundle)
    known = Target(tuple(places[1].tolist()), fixed=False)
    result = identified(replace(bundle, targets={**bundle.targets, "n2": known}))
    # The place is stated from the flange, of which the other nests know no better than link 6 is.
    assert result.held_out.position_rms < 2e-3

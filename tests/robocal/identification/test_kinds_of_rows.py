"""Nests at unknown places, lengths from an anchor, and mixtures in one fit."""

from dataclasses import replace

import numpy as np
import pytest

from robocal.identification.result import Status
from robocal.kinematics.forward import forward_kinematics
from tests.robocal.identification.cells import (
    lengths_from,
    measured,
    tool_distances,
    with_nests,
)

SIGMA = 2e-5


def relative_error(result, cell, seed: int) -> float:
    """RMS error of distances between predicted tool positions at fresh poses [m]."""
    q = cell.nominal.draw(np.random.default_rng(1000 + seed), 300, widest=2.5)
    found = tool_distances(forward_kinematics(result.model, q))
    return float(np.sqrt(np.mean((found - tool_distances(cell.true.poses(q))) ** 2)))


@pytest.mark.parametrize("robot", ["ur10e", "staubli_tx60"])
def test_three_nests_at_unknown_places_give_rank_33(tmp_path, robot, identified):
    bundle, cell, _ = measured(tmp_path, robot, 1, 90, full_pose=False)
    places = np.random.default_rng(3).normal(size=(3, 3)) * 0.1
    result = identified(with_nests(bundle, cell, places, 1, SIGMA))
    # 24 of the chain as for one position, and three coordinates a nest.
    assert result.rank == 33
    assert result.adequacy.adequate
    # Links 6 and nests trade mm for mm: only distances between nests are free of that.
    found = result.cell.places
    for one, other in ((0, 1), (0, 2), (1, 2)):
        gap = np.linalg.norm(found[one] - found[other])
        assert gap == pytest.approx(np.linalg.norm(places[one] - places[other]), abs=1e-4)


def test_a_nest_whose_place_is_stated_is_held_there(tmp_path, identified):
    bundle, cell, _ = measured(tmp_path, "ur10e", 2, 90, full_pose=False)
    places = np.random.default_rng(3).normal(size=(2, 3)) * 0.1
    nests = with_nests(bundle, cell, places, 1, SIGMA)
    known = replace(nests.targets["n1"], place=tuple(places[0]))
    result = identified(replace(nests, targets={**nests.targets, "n1": known}))
    assert np.array_equal(result.cell.places[0], places[0])
    assert result.status("target_n1_x") is Status.fixed
    assert result.adequacy.adequate


def test_lengths_alone_give_the_geometry_but_not_where_the_base_is_turned(tmp_path, identified):
    bundle, cell, T = measured(tmp_path, "ur10e", 3, 90, full_pose=False)
    anchor = cell.true.base[:3, :3] @ [1.0, 0.5, 0.2] + cell.true.base[:3, 3]
    rows = replace(
        bundle.measurements,
        position=np.full((90, 3), np.nan),
        distance=lengths_from(anchor, T, 3, SIGMA),
    )
    result = identified(replace(bundle, measurements=rows, anchor=(0.0, 0.0, 0.0)))
    # 27 of positions less the three turns about the anchor.
    assert result.rank == 24
    assert {"base_yaw", "base_pitch", "base_roll"} <= set(result.reasons)
    assert result.adequacy.adequate
    assert relative_error(result, cell, 3) < 5e-5


def test_positions_and_lengths_are_fitted_together_and_the_anchor_is_found(tmp_path, identified):
    bundle, cell, T = measured(tmp_path, "staubli_tx60", 4, 90, full_pose=False)
    anchor = cell.true.base[:3, :3] @ [0.8, -0.5, 0.3] + cell.true.base[:3, 3]
    first = np.arange(90) < 45
    rows = replace(
        bundle.measurements,
        position=np.where(first[:, None], bundle.measurements.position, np.nan),
        distance=np.where(first, np.nan, lengths_from(anchor, T, 4, SIGMA)),
    )
    result = identified(replace(bundle, measurements=rows))
    assert result.rank == 30
    assert result.adequacy.adequate
    assert result.cell.anchor == pytest.approx(anchor, abs=1e-4)
    assert relative_error(result, cell, 4) < 5e-5


def test_a_prismatic_joint_is_calibrated_too(tmp_path, identified):
    bundle, cell, _ = measured(tmp_path, "abb_irb910sc", 5, 60, full_pose=True)
    result = identified(bundle)
    # Four parameters a revolute joint, two a prismatic one, six for the frames' freedom.
    assert result.rank == 20
    assert relative_error(result, cell, 5) < 3e-5


@pytest.mark.parametrize("robot", ["staubli_tx60", "ur10e"])
def test_full_poses_are_never_worse_than_their_positions_alone(tmp_path, robot, identified):
    ratios = []
    for seed in range(6):
        bundle, cell, _ = measured(tmp_path / str(seed), robot, seed, 60, full_pose=True)
        nothing = np.full_like(bundle.measurements.orientation, np.nan)
        alone = replace(bundle, measurements=replace(bundle.measurements, orientation=nothing))
        q = cell.nominal.draw(np.random.default_rng(seed), 300, widest=2.5)
        true = cell.true.poses(q)[:, :3, 3]
        errors = [
            np.sqrt(np.mean((forward_kinematics(identified(b).model, q)[:, :3, 3] - true) ** 2))
            for b in (bundle, alone)
        ]
        ratios.append(errors[0] / errors[1])
    assert np.mean(ratios) <= 1.0
    assert max(ratios) <= 1.05

"""The second world obeys its physics, and what it hides plainly is named."""

import numpy as np
import pytest

from robocal.diagnosis.catalogue import EFFECTS
from tests.blind.trials import Order, diagnose_bundle, make
from tests.blind.truth import read_truth
from tests.blind.verdict import read_verdict
from tests.second_world.arm import G, N, frames, read_arm
from tests.second_world.campaign import ROBOT, Campaign, Change
from tests.second_world.draw import Draw
from tests.second_world.families import FAMILIES

SHOULDER = np.array([0.0, 0.0, 0.375])
PLAIN = 8.0


@pytest.fixture(scope="module")
def campaign():
    return Campaign(np.random.default_rng(4))


@pytest.mark.parametrize(
    ("degrees", "place"),
    [
        ((0, 0, 0), (0.0, 0.020, 0.670)),
        ((0, 90, 0), (0.670, 0.020, 0.0)),
        ((0, 0, 90), (0.380, 0.020, 0.290)),
    ],
)
def test_the_flange_is_where_the_drawing_of_the_arm_has_it(degrees, place):
    q = np.zeros((1, N))
    q[0, :3] = np.deg2rad(degrees)
    _, o = frames(read_arm(ROBOT).links, q, np.zeros((1, N)), {})
    np.testing.assert_allclose(o[0, N] - SHOULDER, place, atol=1e-12)


def test_torques_are_what_the_potential_energy_loses(campaign):
    def energy(q):
        R, o = frames(campaign.place.links, q, np.zeros((len(q), N)), {})
        centres = [o[:, i + 1] + R[:, i + 1] @ campaign.centre[i] for i in range(N)]
        heights = np.stack([*centres, o[:, N] + R[:, N] @ campaign.payload_centre])[..., 2]
        return G * (campaign.weights.T * heights).sum(axis=0)

    for joint, step in enumerate(1e-5 * np.eye(N)):
        lost = (energy(campaign.q - step) - energy(campaign.q + step)) / 2e-5
        np.testing.assert_allclose(campaign.torque[:, joint], lost, atol=1e-6)


def test_a_load_pulls_the_nest_down(campaign):
    for name in ("joint_compliance", "base_compliance", "link_bending"):
        hidden = FAMILIES[name](Draw(np.random.default_rng(1), campaign, 1.0, other=True))
        change = Change(campaign.n)
        hidden.act(campaign, change)
        moved = (campaign.positions(change) - campaign.positions()) @ campaign.place.axes
        assert (moved @ campaign.down).mean() > 1e-6, name


def test_geometry_leaves_nothing_of_what_geometry_does(campaign):
    change = Change(campaign.n)
    change.growth[:, 1] += 1e-6
    error = campaign.positions(change) - campaign.positions()
    assert np.linalg.norm(campaign.left_by_geometry(error)) < 1e-4 * np.linalg.norm(error)


def test_what_is_plainly_hidden_is_named(tmp_path):
    places = make(tmp_path, Order("one", 12, 20, world="second"))
    plain = 0
    for place in places:
        diagnose_bundle(place.bundle, place.result)
        truth = read_truth(place.truth)
        (hidden,) = truth.effects
        assert hidden.effect in EFFECTS
        if hidden.strength < PLAIN:
            continue
        plain += 1
        assert read_verdict(place.result).named[0].cause.is_(hidden), hidden
    assert plain >= 6

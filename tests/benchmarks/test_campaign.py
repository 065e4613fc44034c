"""The benchmark compares right answers: our fits end at the noise, and skip nothing silently."""

import numpy as np
import pytest

from robocal.kinematics.forward import forward_kinematics
from tests.benchmarks.campaign import POSITION_STD, campaign
from tests.benchmarks.environments import Peer, PeerMissing
from tests.benchmarks.identification import WORKS
from tests.elementary_kinematics import shift, turn


def test_the_campaign_is_craigs_chain_with_errors_of_a_millimetre_or_two():
    measured = campaign(1)
    mean, largest = measured.errors(
        forward_kinematics(measured.nominal, measured.held_out_joints)[:, :3, 3]
    )
    assert 0.5e-3 < mean < 3e-3
    assert largest < 6e-3


def test_the_peers_table_is_the_same_nominal_robot(tmp_path):
    measured = campaign(20)
    measured.save(tmp_path / "campaign.npz")
    saved = np.load(tmp_path / "campaign.npz")
    T = np.eye(4)
    for (alpha, a, theta, d), q in zip(saved["craig"], saved["joints"].T, strict=True):
        T = T @ turn("x", alpha) @ shift("x", a) @ turn("z", theta + q) @ shift("z", d)
    tool = T[:, :3, :3] @ saved["tool"] + T[:, :3, 3]
    own = forward_kinematics(measured.nominal, measured.joints)[:, :3, 3]
    np.testing.assert_allclose(own, tool, atol=1e-12)


@pytest.mark.parametrize("work", WORKS, ids=lambda work: work.name)
def test_our_fits_end_at_the_noise(work):
    measured = campaign(work.rows, frames_known=work.frames_known)
    solution = work.fit(measured)
    T = forward_kinematics(solution.fit.cell.geometry, measured.held_out_joints)
    mean, _ = measured.errors(T[:, :3, 3])
    assert mean < 4.0 * POSITION_STD / np.sqrt(work.rows / 10.0)
    assert 0.7 < solution.chi_square / solution.nu < 1.4


def test_a_peer_that_fails_is_reported_in_one_line(monkeypatch, tmp_path):
    monkeypatch.setattr("tests.benchmarks.environments.ENVIRONMENTS", tmp_path / "peers")
    monkeypatch.setattr("tests.benchmarks.environments.FOLDER", tmp_path)
    (tmp_path / "nobody.txt").write_text("./is-not-there\n")
    with pytest.raises(PeerMissing, match="nobody is skipped: ") as missing:
        Peer("nobody", "with_nobody").run("campaign.npz")
    assert "\n" not in str(missing.value)

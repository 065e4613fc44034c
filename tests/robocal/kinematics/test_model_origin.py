"""A covariance follows its frames when these become the origin."""

import numpy as np

from robocal.frames import frame_from_xyz_ypr
from robocal.kinematics.jacobian import pose_jacobian
from robocal.kinematics.model import KinematicModel
from tests.elementary_kinematics import load_arm


def test_the_targets_spread_is_the_same_when_the_frames_become_the_origin():
    rng = np.random.default_rng(5)
    arm = load_arm("ur5")
    frames = rng.normal(size=(4, 6)) * 0.3
    model = KinematicModel(
        arm.links,
        arm.prismatic,
        base=frames[0],
        tool=frames[1],
        station=frame_from_xyz_ypr(frames[2]),
        flange=frame_from_xyz_ypr(frames[3]),
    )
    q = arm.draw(rng, 5)
    root = rng.normal(size=(model.n_parameters, model.n_parameters)) * 1e-4
    # Heights of base and tool that nothing tells apart: metres that cancel to micrometres.
    root[[-10, -4]] *= 1e4
    covariance = root @ root.T

    def spread(model, covariance):
        J = np.moveaxis(pose_jacobian(model, q)[1][:, :3], 2, 0)
        return np.einsum("mpi,pk,mkj->mij", J, covariance, J)

    moved = spread(model.with_frames_as_origin(), model.covariance_at_origin(covariance))
    np.testing.assert_allclose(moved, spread(model, covariance), rtol=1e-6, atol=1e-12)

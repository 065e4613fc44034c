"""AP and RP against an example worked out by hand."""

import numpy as np
import pytest

from robocal.errors import BadInput
from robocal.iso_9283 import pose_figures, pose_figures_document


def frame(position=(0.0, 0.0, 0.0), rotation=((1, 0, 0), (0, 1, 0), (0, 0, 1))) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation, position
    return T


def about_z(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])


# Commanded (500, 0, 300) mm. Visits at x 500.1, 500.3, 500.2, 500.2; y 0, 0, 0.1, -0.1; z 300.2.
# Barycentre (500.2, 0, 300.2): AP_p = sqrt(0.2^2 + 0 + 0.2^2) = 0.282843 mm.
# Each visit is 0.1 mm from it: mean 0.1, S_l 0, RP_l = 0.1 mm.
CIRCLE = np.array([[500.1, 0, 300.2], [500.3, 0, 300.2], [500.2, 0.1, 300.2], [500.2, -0.1, 300.2]])


def test_visits_on_a_circle_about_their_barycentre():
    figures = pose_figures(frame((0.5, 0, 0.3)), CIRCLE * 1e-3)
    document = pose_figures_document(figures)
    assert document["AP_p_mm"] == pytest.approx(0.282843, abs=1e-6)
    assert document["AP_xyz_mm"] == pytest.approx([0.2, 0, 0.2])
    assert document["RP_l_mm"] == pytest.approx(0.1)
    assert document["visits"] == 4
    assert document["AP_abc_deg"] is None


def test_repeatability_is_the_mean_distance_and_three_deviations():
    # Along x at 0, 0, 0, 4 mm: barycentre 1 mm, distances 1, 1, 1, 3, mean 1.5,
    # S_l = sqrt((3 * 0.25 + 2.25) / 3) = 1, so RP_l = 1.5 + 3 = 4.5 mm and AP_p = 1 mm.
    attained = np.array([[0.0, 0, 0], [0, 0, 0], [0, 0, 0], [0.004, 0, 0]])
    figures = pose_figures(frame(), attained)
    assert figures.RP_position == pytest.approx(4.5e-3)
    assert figures.AP_position == pytest.approx(1e-3)


def test_angles_are_turns_about_the_commanded_poses_own_axes():
    # c of 1, 2 and 3 mrad: AP_c = 2 mrad, S_c = 1 mrad, RP_c = 3 mrad, wherever the pose points.
    commanded = np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]])
    rotations = np.stack([commanded @ about_z(angle) for angle in (1e-3, 2e-3, 3e-3)])
    figures = pose_figures(frame(rotation=commanded), np.zeros((3, 3)), rotations)
    assert figures.AP_angles == pytest.approx([0, 0, 2e-3], abs=1e-12)
    assert figures.RP_angles == pytest.approx([0, 0, 3e-3], abs=1e-12)


def test_one_visit_has_an_accuracy_and_no_repeatability():
    figures = pose_figures(frame(), np.array([[1e-3, 2e-3, 2e-3]]), np.eye(3)[None])
    assert figures.AP_position == pytest.approx(3e-3)
    assert figures.RP_position is None
    assert figures.RP_angles is None


def test_a_pose_without_a_visit_is_refused():
    with pytest.raises(BadInput, match="was not visited"):
        pose_figures(frame(), np.zeros((0, 3)))

import numpy as np
import pytest

from robocal.kinematics.forward import forward_kinematics
from robocal.planning.capsules import Segment, arm_shape, distance, is_hidden, self_clearance
from robocal.planning.cell import Cell
from robocal.robots.library import load_robot


def column(*point):
    return np.array(point, dtype=float)[:, None]


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        (((0, 0, 0), (1, 0, 0)), ((0.5, -1, 2), (0.5, 1, 2)), 2.0),
        (((0, 0, 0), (1, 0, 0)), ((0, 3, 0), (1, 3, 0)), 3.0),
        (((0, 0, 0), (1, 0, 0)), ((3, 0, 0), (5, 0, 0)), 2.0),
        (((0, 0, 0), (0, 0, 0)), ((0, 3, 4), (0, 3, 4)), 5.0),
        (((0, 0, 0), (1, 1, 1)), ((1, 1, 0), (0, 0, 1)), 0.0),
    ],
)
def test_the_distance_of_two_segments(one, other, expected):
    first, second = (Segment(column(*a), column(*b)) for a, b in (one, other))
    assert distance(first, second)[0] == pytest.approx(expected)
    assert distance(second, first)[0] == pytest.approx(expected)


def test_the_distance_is_the_least_over_a_fine_grid_of_points():
    rng = np.random.default_rng(1)
    ends = rng.normal(size=(4, 3, 200))
    found = distance(Segment(ends[0], ends[1]), Segment(ends[2], ends[3]))
    share = np.linspace(0, 1, 81)
    on_one = ends[0] + share[:, None, None, None] * (ends[1] - ends[0])
    on_other = ends[2] + share[None, :, None, None] * (ends[3] - ends[2])
    least = np.linalg.norm(on_one - on_other, axis=2).min(axis=(0, 1))
    assert (found <= least + 1e-12).all()
    # A grid of 1/80 misses the nearest points by at most half a step on either segment.
    step = np.linalg.norm(ends[1] - ends[0], axis=0) + np.linalg.norm(ends[3] - ends[2], axis=0)
    assert (least - found <= step / 160).all()


def test_the_arms_lines_join_from_the_pedestal_to_the_target():
    robot = load_robot("ur10e")
    q = np.random.default_rng(2).uniform(-3, 3, size=(50, 6))
    model = Cell().model(robot)
    shape = arm_shape(model, q, floor=-0.5)
    for one, following in zip(shape.segments, shape.segments[1:], strict=False):
        assert np.allclose(one.end, following.start, atol=1e-12)
    assert np.allclose(shape.segments[0].start[:, 0], (0, 0, -0.5))
    assert np.allclose(shape.target.T, forward_kinematics(model, q)[:, :3, 3])


def test_an_arm_folded_onto_its_foot_touches_itself_and_a_stretched_one_does_not():
    robot = load_robot("ur10e")
    stretched = np.array([[0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0]])
    folded = np.array([[0.0, -np.pi / 2, 3.1, -np.pi / 2, 0.0, 0.0]])
    shapes = [arm_shape(Cell().model(robot), q, 0.0) for q in (stretched, folded)]
    assert [bool(self_clearance(shape, 0.06)[0] < 0) for shape in shapes] == [False, True]


def test_the_arm_hides_its_target_from_a_tracker_behind_it_only():
    robot = load_robot("ur10e")
    q = np.array([[0.0, -0.3, 0.6, -0.3, 0.0, 0.0]])
    shape = arm_shape(Cell().model(robot), q, 0.0)
    target = shape.target[:, 0]
    before = tuple((target * 3.0).tolist())
    behind = tuple((-target).tolist())
    assert not is_hidden(shape, 0.06, before)[0]
    assert is_hidden(shape, 0.06, behind)[0]

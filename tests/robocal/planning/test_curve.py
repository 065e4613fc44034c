import numpy as np
import pytest

from robocal.planning.candidates import draw_candidates
from robocal.planning.cell import Box, Cell
from robocal.planning.curve import SETTLED, IndexCurve, index_curve
from robocal.planning.document_002 import PARAMETERS, document_rows
from robocal.planning.observability import INDICES
from robocal.planning.pose_rows import scale_columns


def planted(values, counts):
    mean = dict.fromkeys(INDICES, values)
    return IndexCurve(counts, mean, mean)


def test_an_index_settles_where_doubling_the_poses_brings_no_more():
    counts = np.arange(3, 401)
    curve = planted(1.0 - 1.0 / counts, counts)
    # O(2m)/O(m) - 1 = 0.5 / (m - 1): reaches the limit at m = 1 + 0.5 / SETTLED; the line over
    # the window is a little less steep than its first half.
    assert curve.settled_count("O1") == pytest.approx(1 + 0.5 / SETTLED, abs=2)


def test_an_index_that_grows_as_the_root_of_the_number_never_settles():
    counts = np.arange(3, 401)
    assert planted(np.sqrt(counts), counts).settled_count("O3") is None


def test_on_the_documents_cell_o1_and_o2_settle_and_the_others_do_not(tx60):
    # Document 002, section 4.2: workspace 900 x 1200 x 800 mm about (250, 0, 200), 1000 poses.
    cell = Cell((0.0, 0.0, 0.0), Box((-0.2, -0.6, -0.2), (0.7, 0.6, 0.6)), floor=-0.375)
    q = draw_candidates(tx60, 1000, np.random.default_rng(1), cell)
    J, _ = scale_columns(document_rows(tx60.geometry, q))
    assert J.shape == (1000, 12, len(PARAMETERS))
    assert np.linalg.matrix_rank(J[:50].reshape(-1, 24)) == 24
    curve = index_curve(J, seed=1, most=80, draws=20)
    assert curve.counts[0] == 2
    settled = {name: curve.settled_count(name) for name in INDICES}
    assert settled["O1"] is not None
    assert settled["O2"] is not None
    assert [settled[name] for name in ("O3", "O4", "O5")] == [None] * 3
    assert curve.mean["O3"][-1] / curve.mean["O3"][38] == pytest.approx(np.sqrt(2), rel=0.1)


def test_the_curve_is_the_same_for_a_seed_and_ends_with_the_candidates(rows):
    one, other = (index_curve(rows.J, seed=9, draws=4) for _ in range(2))
    assert one.counts[-1] == len(rows.J)
    for name in INDICES:
        assert np.array_equal(one.mean[name], other.mean[name])
        # Only one set has all candidates.
        assert one.std[name][-1] == pytest.approx(0.0, abs=1e-12)


def test_the_documents_rows_are_the_derivatives_of_the_pose_matrix(tx60, candidates):
    from robocal.kinematics.forward import forward_kinematics
    from robocal.kinematics.model import parameter_names

    q, step = candidates[:5], 1e-6
    J = document_rows(tx60.geometry, q)
    names = parameter_names(6)
    for column, name in enumerate(PARAMETERS):
        vector = tx60.geometry.vector
        shift = np.zeros_like(vector)
        shift[names.index(name)] = step
        ahead = forward_kinematics(tx60.geometry.with_vector(vector + shift), q)
        behind = forward_kinematics(tx60.geometry.with_vector(vector - shift), q)
        slope = (ahead - behind)[:, :3] / (2 * step)
        expected = np.concatenate([slope[:, :, k] for k in range(4)], axis=1)
        # Central differences at 1e-6 round at 1e-10.
        assert np.abs(J[:, :, column] - expected).max() < 1e-8

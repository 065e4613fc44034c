"""Rows held out that the model does not predict, though no fit has seen them."""

import numpy as np
from jaxtyping import Bool
from numpy import ndarray as Array

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.find import Steps, settles
from robocal.diagnosis.joint_fit import JointFit
from robocal.diagnosis.judged_again import blocks_of_rows, score_again
from robocal.diagnosis.steps import gap_of, is_step
from robocal.diagnosis.target_distances import Targets
from robocal.diagnosis.thinning import chosen_rows
from robocal.formats.bundle import Bundle, RejectedRow
from robocal.identification.outliers import named_outliers, score_blocks
from robocal.identification.prepared import Prepared
from robocal.identification.solve import Solution


def suspect_rows(
    bundle: Bundle, ready: Prepared, targets: Targets, solution: Solution, steps: Steps
) -> tuple[RejectedRow, ...]:
    """Rows held out that look wrong, judged like those of the fit; they count all the same."""
    rows = np.flatnonzero(ready.rows.held_out)
    if settles(steps.found):
        # From where the arm came to the first row nobody knows.
        rows = rows[rows > 0]
    if not len(rows):
        return ()
    chosen = chosen_rows(rows, len(ready.rows))
    measured, around = ready.observe(bundle, chosen), targets.around.rows(chosen)
    fitted = np.ones(len(steps.fitted), dtype=bool)
    scale = score_again(steps.found, solution.problem.rows, steps.rows, fitted).scale
    blocks = blocks_of_rows(steps.found, measured, around)
    none = np.zeros(len(measured), dtype=bool)
    scores = score_blocks(blocks, measured, steps.found.covariance, none, scale)
    told = scores.outlying & _is_told(steps.found, around)
    return named_outliers(around.lines, scores, told)


def _is_told(found: JointFit, around: Circumstances) -> Bool[Array, "row"]:
    """Rows that the model says something about: not in the gap where a step lies somewhere."""
    told = np.ones(len(around), dtype=bool)
    for fitted in found.effects:
        if is_step(fitted.instance):
            before, first = gap_of(fitted.instance)
            told &= (around.lines <= before) | (around.lines >= first)
    return told

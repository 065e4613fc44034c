"""Rows judged again once causes are in the model.

To the geometry alone the rows that a strong cause moves most look like outliers: with the cause
they fit, and speak for it.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool
from numpy import ndarray as Array

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.joint_fit import JointFit
from robocal.identification.observations import Observations
from robocal.identification.outliers import RowScores, score_blocks
from robocal.identification.problem import WhitenedBlock, whitened_blocks
from robocal.identification.solve import scaled_inverse


def score_again(
    found: JointFit, measured: Observations, around: Circumstances, used: Bool[Array, "row"]
) -> RowScores:
    """Score every row against geometry and effects.

    Parameters
    ----------
    found
        The model.
    measured, around
        Rows, row for row the same.
    used
        Those that the model was fitted to.
    """
    blocks = blocks_of_rows(found, measured, around)
    # Of this very place: with the covariance of another a row's share in the fit may exceed one.
    information = np.diag(found.fit.precision)
    for block in blocks:
        took_part = block.J[:, np.tile(used[block.rows], block.components)]
        information = information + took_part @ took_part.T
    return score_blocks(blocks, measured, scaled_inverse(information), used)


def blocks_of_rows(
    found: JointFit, measured: Observations, around: Circumstances
) -> list[WhitenedBlock]:
    """Whitened rows by the unknowns of the joint fit, less what the effects add."""
    everything = np.arange(len(found.cell.names))
    blocks = whitened_blocks(found.cell, measured, everything)
    return [_with_effects(block, found, around) for block in blocks]


def _with_effects(block: WhitenedBlock, found: JointFit, around: Circumstances) -> WhitenedBlock:
    """Columns of the unknowns of the joint fit, and the residual less the effects'."""
    columns, r = [block.J[found.fit.free]], block.r
    for fitted in found.effects:
        moves = EFFECTS[fitted.instance.effect].moves(around, fitted.instance)
        X = np.zeros((len(fitted.values), len(r)))
        for parameter, values in moves.items():
            X += block.J[parameter] * np.tile(values[block.rows].T, block.components)
        columns.append(X)
        r = r - fitted.values @ X
    return replace(block, J=np.concatenate(columns), r=r)

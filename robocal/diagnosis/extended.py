"""Prediction with effects: every row has geometric parameters of its own."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Instance, Moves
from robocal.diagnosis.reference import PAYLOAD
from robocal.errors import BadInput
from robocal.kinematics.forward import Columns, chain
from robocal.kinematics.model import KinematicModel
from robocal.measurements import approach_column


@dataclass(frozen=True)
class FittedEffect:
    """An effect in the model, its coefficients found."""

    instance: Instance
    values: Float[Array, "coefficient"]
    covariance: Float[Array, "coefficient coefficient"]

    @property
    def std(self) -> Float[Array, "coefficient"]:
        """Standard uncertainty of the coefficients."""
        return np.sqrt(np.diag(self.covariance))


def moves_of(rows: Circumstances, effects: tuple[FittedEffect, ...]) -> Moves:
    """Total change of each parameter, row by row, as one column each."""
    total: Moves = {}
    for fitted in effects:
        effect = EFFECTS[fitted.instance.effect]
        for parameter, pattern in effect.moves(rows, fitted.instance).items():
            change = (pattern @ fitted.values)[:, None]
            total[parameter] = total[parameter] + change if parameter in total else change
    return total


def coefficient_shifts(
    J: Float[Array, "row parameter 3"], rows: Circumstances, effects: tuple[FittedEffect, ...]
) -> Float[Array, "row coefficient 3"]:
    """How the target moves with every coefficient, given how it moves with every parameter."""
    parts = [np.zeros((len(J), 0, 3))]
    for fitted in effects:
        moves = EFFECTS[fitted.instance.effect].moves(rows, fitted.instance)
        shifts = (D[:, :, None] * J[:, parameter, None] for parameter, D in moves.items())
        parts.append(sum(shifts, np.zeros((len(J), len(fitted.values), 3))))
    return np.concatenate(parts, axis=1)


def predict(
    model: KinematicModel, rows: Circumstances, effects: tuple[FittedEffect, ...]
) -> Columns:
    """Target frames with the effects acting.

    Parameters
    ----------
    model
        Identified geometry; its frames stand in `station` and `flange`
        (`KinematicModel.with_frames_as_origin`).
    rows
        Where the robot was and what was going on.
    effects
        What acts besides the geometry.
    """
    return predict_at(model, rows.joints, moves_of(rows, effects))


def refuse_lacking(
    rows: Circumstances, effects: tuple[FittedEffect, ...], lines: Int[Array, "row"]
) -> None:
    """Complain about the first row that does not say what an effect depends on.

    Parameters
    ----------
    lines
        Of the file that the rows are from.

    Raises
    ------
    BadInput
        Naming its line, the columns and the effects that need them.
    """
    unknown = {fitted.instance: _unknown_rows(rows, fitted) for fitted in effects}
    some = np.any([np.zeros(len(rows), dtype=bool), *unknown.values()], axis=0)
    if not some.any():
        return
    row = int(np.argmax(some))
    lacking = [instance for instance, mask in unknown.items() if mask[row]]
    alone = rows.rows(np.array([row]))
    needed = {name for fitted in effects for name in _columns_lacking(alone, fitted)}
    names = ", ".join(instance.title for instance in lacking)
    raise BadInput(
        f"line {lines[row]}",
        f"lacks {' and '.join(sorted(needed))}, which the model's effects need ({names})",
    )


def _unknown_rows(rows: Circumstances, fitted: FittedEffect) -> Bool[Array, "row"]:
    moves = moves_of(rows, (fitted,)).values()
    return np.asarray(np.isnan(np.concatenate(list(moves), axis=1)).any(axis=1))


def _columns_lacking(row: Circumstances, fitted: FittedEffect) -> list[str]:
    """Columns of which one alone, left empty, leaves the effect unknown in a row."""
    stated = {
        "temperature_degc": {"temperature": row.temperature},
        PAYLOAD: {"payload": row.payload},
    }
    if fitted.instance.joint is not None:
        stated[approach_column(fitted.instance.joint)] = {"approach": row.approach}
    whole = {name: np.nan_to_num(cells) for kind in stated.values() for name, cells in kind.items()}
    return [
        column
        for column, cells in stated.items()
        if _unknown_rows(replace(row, **{**whole, **cells}), fitted).any()
    ]


def predict_at(model: KinematicModel, q: Float[Array, "row joint"], moves: Moves) -> Columns:
    """Target frames with parameters moved row by row."""
    n, m = model.n_joints, len(q)
    links = np.repeat(model.links[:, :, None], m, axis=2)
    base, tool = np.repeat(model.base[:, None], m, 1), np.repeat(model.tool[:, None], m, 1)
    for parameter, values in moves.items():
        if parameter < 5 * n:
            links[parameter // 5, parameter % 5] += values[:, 0]
        elif parameter < 5 * n + 6:
            base[parameter - 5 * n] += values[:, 0]
        else:
            tool[parameter - 5 * n - 6] += values[:, 0]
    start = _then_frames(_constant(model.station, m), base).then(model.mount)
    last, _ = chain(start, links, model.prismatic, q.T)
    return _then_frames(last.then(model.flange), tool)


def _constant(T: Float[Array, "4 4"], m: int) -> Columns:
    x, y, z, p = (np.repeat(T[:3, k : k + 1], m, axis=1) for k in range(4))
    return Columns(x, y, z, p)


def _then_frames(frame: Columns, moved: Float[Array, "6 row"]) -> Columns:
    """The frame after a six-parameter frame of its own in every row."""
    x, y, z = frame.x, frame.y, frame.z
    p = frame.p + x * moved[0] + y * moved[1] + z * moved[2]
    (cy, cp, cr), (sy, sp, sr) = np.cos(moved[3:]), np.sin(moved[3:])
    x, y = x * cy + y * sy, y * cy - x * sy
    x, z = x * cp - z * sp, z * cp + x * sp
    y, z = y * cr + z * sr, z * cr - y * sr
    return Columns(x, y, z, p)

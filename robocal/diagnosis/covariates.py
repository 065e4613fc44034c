"""What the residuals depend on, whatever the cause: smooth blocks over each covariate.

For a covariate z the columns are basis functions of z times the derivative with respect to every
joint, the base and the tool. A block that stands out where nothing of the catalogue does names the
covariate of an unknown cause.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.special import betainc

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Moves, base_index, theta, tool_index
from robocal.diagnosis.evidence import chi_square
from robocal.diagnosis.linearised import Linearised

SIGNIFICANT = 1e-4
"""Chance per block that counts as a dependence; [1]"""
ORIENTATION = "tool_orientation"
_DUST = 1e-4
"""Share of a column that projection must leave: geometry is known to no more digits; [1]"""
SWAYS = 12
"""Half periods of a slow sway over the campaign; [1]"""


@dataclass(frozen=True)
class Dependence:
    """One covariate and how improbable its block is by chance."""

    covariate: str
    p_value: float


def dependences(rows: Circumstances, fit: Linearised) -> list[Dependence]:
    """Every covariate with its p-value, strongest first."""
    found = []
    blocks = [(name, _block(rows, fit, basis)) for name, basis in _bases(rows).items()]
    blocks.append((clock(rows), _sway(rows, fit)))
    blocks.append((ORIENTATION, fit.columns(seen_askew(rows))))
    for name, X in blocks:
        X = _surviving(fit, X)
        statistic = float(chi_square(X.T @ X, X.T @ fit.r))
        k = _rank(X)
        nu = fit.n_measured - fit.basis.shape[1] - k
        if k == 0 or nu <= 0:
            continue
        rest = max(float(fit.r @ fit.r) - statistic, 1e-300)
        # Never less than the declared noise: where that is too large nothing can be told from it.
        F = (statistic / k) / max(rest / nu, 1.0)
        found.append(Dependence(name, float(betainc(nu / 2, k / 2, nu / (nu + k * F)))))
    found.sort(key=lambda dependence: dependence.p_value)
    strongest = {dependence.covariate: dependence for dependence in reversed(found)}
    return sorted(strongest.values(), key=lambda dependence: dependence.p_value)


def clock(rows: Circumstances) -> str:
    """What time is called."""
    return "t_s" if rows.timed else "row"


def _sway(rows: Circumstances, fit: Linearised) -> Float[Array, "scalar column"]:
    """The base shifted to and fro with time, faster than a drift."""
    base = base_index(rows)
    columns = fit.W[base : base + 3].T[:, :, None] * sways(rows)[fit.row][:, None, :]
    return np.asarray(columns.reshape(len(fit.row), -1))


def sways(rows: Circumstances) -> Float[Array, "row wave"]:
    """Cosines of 1, 2 ... `SWAYS` half periods over the campaign."""
    share = (rows.time - rows.time.min()) / (np.ptp(rows.time) or 1.0)
    return np.cos(np.pi * np.outer(share, np.arange(1, SWAYS + 1)))


def waves(reading: Float[Array, "row"]) -> Float[Array, "row 4"]:
    """Once and twice a turn."""
    return np.stack(
        [np.cos(reading), np.sin(reading), np.cos(2 * reading), np.sin(2 * reading)], axis=1
    )


def seen_askew(rows: Circumstances) -> Moves:
    """The target seems to move along the beam as it turns away from the instrument."""
    length = np.linalg.norm(rows.position, axis=1, keepdims=True)
    beam = (rows.position / np.maximum(length, 1e-9)) @ rows.base_rotation
    facing = np.stack([(beam * axis.T).sum(axis=1) for axis in rows.tool_axes], axis=1)
    base = base_index(rows)
    return {base + axis: beam[:, axis : axis + 1] * facing for axis in range(3)}


def _bases(rows: Circumstances) -> dict[str, Float[Array, "row function"]]:
    """Basis functions of every covariate that varies."""
    bases: dict[str, Float[Array, "row function"]] = {}
    for joint, (unit, reading) in enumerate(
        zip(rows.robot.joint_units, rows.joints.T, strict=True), start=1
    ):
        bases[f"j{joint}_{unit}"] = waves(reading)
    for joint, direction in enumerate(np.nan_to_num(rows.approach).T, start=1):
        if np.ptp(direction) > 0:
            bases[f"approach{joint}"] = direction[:, None]
    for joint, move in enumerate((rows.joints - rows.previous).T, start=1):
        if np.ptp(move) > 0:
            bases[f"move{joint}"] = move[:, None]
    bases[clock(rows)] = scaled_powers(rows.time)
    for name, values in (
        ("temperature_degc", rows.temperature),
        ("payload_kg", rows.payload),
        ("speed", rows.speed),
        ("settle_s", rows.settle),
        ("reach_mm", rows.reach),
    ):
        if np.isfinite(values).all() and np.ptp(values) > 0:
            bases[name] = scaled_powers(values)
    return bases


def scaled_powers(values: Float[Array, "row"]) -> Float[Array, "row 2"]:
    """First and second power of values brought to [-1, 1]."""
    span = np.ptp(values)
    scaled = 2.0 * (values - values.min()) / (span if span > 0 else 1.0) - 1.0
    return np.stack([scaled, scaled**2 - np.mean(scaled**2)], axis=1)


def _block(
    rows: Circumstances, fit: Linearised, basis: Float[Array, "row function"]
) -> Float[Array, "scalar column"]:
    base, tool = base_index(rows), tool_index(rows)
    parameters = [theta(joint, rows) for joint in range(1, rows.n_joints + 1)]
    parameters += [*range(base, base + 6), *range(tool, tool + 3)]
    columns = fit.W[parameters].T[:, :, None] * basis[fit.row][:, None, :]
    X = columns.reshape(len(fit.row), -1)
    length = np.linalg.norm(X, axis=0)
    return np.asarray(X[:, length > 0] / length[length > 0])


def _surviving(
    fit: Linearised, X: Float[Array, "scalar column"]
) -> Float[Array, "scalar surviving"]:
    """What projection leaves of the columns; of some it leaves dust alone."""
    before = np.linalg.norm(X, axis=0)
    X = X - fit.basis @ (fit.basis.T @ X)
    return np.asarray(X[:, np.linalg.norm(X, axis=0) > _DUST * before])


def _rank(X: Float[Array, "scalar column"]) -> int:
    if not X.shape[1]:
        return 0
    values = np.linalg.eigvalsh(X.T @ X)
    return int((values > 1e-8 * max(values[-1], 1e-300)).sum())

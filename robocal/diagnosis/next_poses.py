"""Poses at which two causes predict most differently: T-optimal, chosen one after the other.

References
----------
.. [1] A. C. Atkinson, V. V. Fedorov, "The design of experiments for discriminating between two
   rival models", Biometrika 62(1), 1975.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.causes import Cause
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.diagnosis import NextPoses
from robocal.diagnosis.joint_fit import JointFit
from robocal.kinematics.jacobian import pose_jacobian
from robocal.planning.candidates import draw_candidates

COUNT = 20
_POOL = 300

_SPLITS: dict[frozenset[str], str] = {
    frozenset({"joint_compliance", "payload_compliance"}): (
        "measure the same poses without and with a payload"
    ),
    frozenset({"joint_compliance", "link_bending"}): (
        "load the arm sideways (mount it tilted) or measure a nest on the link itself"
    ),
    frozenset({"joint_compliance", "base_compliance"}): "measure a nest on the base plate",
    frozenset({"joint_compliance", "gear_harmonic"}): (
        "measure with a second payload, and sweep the joint alone over more than 270 degrees"
    ),
    frozenset({"base_drift", "base_step"}): (
        "re-measure three fixed nests beside the robot every 10 to 20 poses"
    ),
    frozenset({
        "base_step",
        "tool_step",
    }): "re-measure fixed nests, with the wrist turned both ways",
    frozenset({"base_drift", "warm_up"}): "re-measure fixed nests, and log the arm's temperature",
    frozenset({"thermal_expansion", "base_drift"}): "heat the arm up and let it cool down again",
    frozenset({"gear_harmonic", "encoder_gain"}): "sweep the joint alone over its whole range",
    frozenset({"backlash", "settling"}): "vary speed and settling time at the same approach",
}


def split_causes(rows: Circumstances, found: JointFit, pair: tuple[Cause, Cause]) -> NextPoses:
    """Poses and words that would tell two causes apart.

    Parameters
    ----------
    rows, found
        What was measured and the model with its effects.
    pair
        The two leading causes for one effect of the model.
    """
    pool = _pool(rows)
    fit = found.judged
    geometry = found.cell.geometry
    _, J = pose_jacobian(geometry, pool.joints)
    weight = float(np.sqrt(np.mean(np.sum(fit.W[-12:-9] ** 2, axis=0)) / 1.0))
    W = np.moveaxis(J[:, :3], 0, 2) * weight  # (3, pose, parameter)
    difference = np.zeros((3, len(pool)))
    for sign, cause in zip((1.0, -1.0), pair, strict=True):
        effect = EFFECTS[cause.instance.effect]
        values = _fitted_values(rows, found, cause)
        for parameter, pattern in effect.moves(pool, cause.instance).items():
            difference += sign * W[:, :, parameter] * (pattern @ values)
    known = np.moveaxis(W[:, :, fit.free], 1, 0)  # (pose, 3, free)
    gram = fit.known[:, : len(fit.free)].T @ fit.known[:, : len(fit.free)]
    gram = gram + np.diag(fit.prior_precision)
    chosen = _greedy(known, difference.T, gram, COUNT)
    names = frozenset({pair[0].instance.effect, pair[1].instance.effect})
    words = tuple(
        word
        for word in (
            _SPLITS.get(names, ""),
            *(EFFECTS[cause.instance.effect].needs for cause in pair),
        )
        if word
    )
    return NextPoses(
        pool.joints[chosen],
        pool.approach[chosen],
        (pair[0].instance.title, pair[1].instance.title),
        words,
    )


def _pool(rows: Circumstances) -> Circumstances:
    """Admissible poses with random approaches, other circumstances drawn from the measured ones."""
    rng = np.random.default_rng(0)
    q = draw_candidates(rows.robot, _POOL, rng)
    like = rng.integers(0, len(rows), size=len(q))
    chosen = rows.rows(like)
    approach = rng.choice([-1.0, 1.0], size=q.shape)
    return replace(
        chosen,
        joints=q,
        previous=q - approach * 0.5,
        approach=approach,
        lines=np.full(len(q), int(rows.lines.max()) + 1),
    )


def _fitted_values(
    rows: Circumstances, found: JointFit, cause: Cause
) -> Float[Array, "coefficient"]:
    """Coefficients of a cause: the model's own, or what this cause would need to stand in."""
    for fitted in found.effects:
        if fitted.instance == cause.instance:
            return fitted.values
    fit = found.judged
    X = fit.columns(EFFECTS[cause.instance.effect].moves(rows, cause.instance))
    effect_part = sum(
        (fit.columns(EFFECTS[f.instance.effect].moves(rows, f.instance)) @ f.values)
        for f in found.effects
    )
    y = fit.r + effect_part
    geometric = replace(fit, more=fit.more[:, :0], more_precision=fit.more_precision[:0])
    M = X.T @ X - (geometric.basis.T @ X).T @ (geometric.basis.T @ X)
    b = X.T @ (y - geometric.basis @ (geometric.basis.T @ y))
    precision = np.diag(cause.instance.prior_std**-2.0)
    return np.asarray(np.linalg.solve(M + precision, b))


def _greedy(
    known: Float[Array, "pose 3 free"],
    difference: Float[Array, "pose 3"],
    gram: Float[Array, "free free"],
    count: int,
) -> list[int]:
    """Poses whose difference the geometry cannot take up, given the measured and the chosen."""
    chosen: list[int] = []
    pulled = np.zeros(len(gram))
    for _ in range(count):
        scale = 1.0 / np.sqrt(np.diag(gram))
        inverse = np.linalg.inv(gram * np.outer(scale, scale)) * np.outer(scale, scale)
        left = difference - known @ (inverse @ pulled)
        value = (left**2).sum(axis=1)
        value[chosen] = -np.inf
        best = int(np.argmax(value))
        chosen.append(best)
        gram = gram + known[best].T @ known[best]
        pulled = pulled + known[best].T @ difference[best]
    return chosen

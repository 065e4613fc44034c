r"""Poses that tell the leading cause from its rivals: T-optimal [1]_, chosen one after the other.

A rival stands in for the leading cause as well as it can: with its own coefficients, the geometry
and the other effects all free. What it cannot take up of the leading cause's signal,

.. math:: \Delta = \min_\beta |s - K \beta|^2_{measured + chosen},

is what tells the two apart; the next pose is the one that raises it most. Each rival counts by its
probability, and each pair both ways. Where the rival is that nothing acts, K holds no column of
its own.

References
----------
.. [1] A. C. Atkinson, V. V. Fedorov, "The design of experiments for discriminating between two
   rival models", Biometrika 62(1), 1975.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.causes import Naming
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.diagnosis import NextPoses
from robocal.diagnosis.effect import Instance, base_index
from robocal.diagnosis.joint_fit import JointFit
from robocal.diagnosis.linearised import Linearised
from robocal.kinematics.jacobian import pose_jacobian
from robocal.planning.candidates import draw_candidates

COUNT = 20
_POOL = 300
_MOST_RIVALS = 4
NOTHING = "nothing"
"""What a cause is split from where the data hardly show it."""
_LATER = 0.05
"""When the poses will be measured, after the end, as a share of the campaign; [1]"""
_HARDLY_SEEN = "measure more poses, or each of them several times: the effect hardly stands out"

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


def split_causes(
    rows: Circumstances, found: JointFit, positions: tuple[int, ...], naming: Naming
) -> NextPoses:
    """Poses and words that would tell the causes of one effect apart.

    Parameters
    ----------
    rows, found
        What was measured and the model with its effects.
    positions
        Of the effect in question, and of those that mend its form.
    naming
        What may stand in its place.
    """
    rest = found.without(found.judged, *positions)
    stated = [cause.instance for cause in naming.stated[: _MOST_RIVALS + 1]]
    pool = _pool(rows, found, rest, positions)
    chosen = np.array(_greedy(_questions(rows, rest, pool, naming), COUNT))
    around = pool.around
    if around.has_payload:
        # One change of the payload, not twenty.
        chosen = chosen[np.argsort(around.payload[chosen], kind="stable")]
    payload = around.payload if around.has_payload else np.full(len(around), np.nan)
    second = naming.stated[1].probability if len(stated) > 1 else 0.0
    rival = stated[1].title if second > naming.none else NOTHING
    return NextPoses(
        around.joints[chosen],
        around.approach[chosen],
        payload[chosen],
        (stated[0].title, rival),
        (_HARDLY_SEEN,) if rival == NOTHING else _words(stated[:2]),
    )


def _words(causes: list[Instance]) -> tuple[str, ...]:
    """What else would tell them apart; what each needs to be seen at all the rows have."""
    words = _SPLITS.get(frozenset(cause.effect for cause in causes))
    return () if words is None else (words,)


@dataclass(frozen=True)
class _Pool:
    """Poses to choose from."""

    around: Circumstances
    W: Float[Array, "pose 3 parameter"]
    """Whitened derivative with respect to every geometric parameter."""
    known: Float[Array, "pose 3 column"]
    """Of geometry and the other effects."""

    def columns(self, instance: Instance) -> Float[Array, "pose 3 coefficient"]:
        """Whitened effect of an instance."""
        moves = EFFECTS[instance.effect].moves(self.around, instance)
        shifts = (self.W[:, :, parameter, None] * D[:, None] for parameter, D in moves.items())
        nothing = np.zeros((len(self.around), 3, len(instance.coefficients)))
        return np.asarray(sum(shifts, nothing))


def _pool(
    rows: Circumstances, found: JointFit, rest: Linearised, positions: tuple[int, ...]
) -> _Pool:
    around = _poses_to_choose_from(rows)
    geometry = found.cell.geometry
    _, J = pose_jacobian(geometry, around.joints)
    base = base_index(rows)
    seen = np.sqrt(np.sum(rest.W[base : base + 3] ** 2, axis=0))
    W = np.moveaxis(J[:, :3], [0, 1, 2], [2, 1, 0]) * float(np.median(seen[seen > 0]))
    known = np.zeros((len(around), 3, len(rest.free)))
    own = rest.free < geometry.n_parameters
    known[:, :, own] = W[:, :, rest.free[own]]
    pool = _Pool(around, W, known)
    others = [f.instance for k, f in enumerate(found.effects) if k not in positions]
    every = [known, *(pool.columns(instance) for instance in others)]
    return replace(pool, known=np.concatenate(every, axis=2))


def _poses_to_choose_from(rows: Circumstances) -> Circumstances:
    """Admissible poses with random approaches, soon after the last row, at every known payload."""
    rng = np.random.default_rng(0)
    q = draw_candidates(rows.robot, _POOL, rng)
    approach = rng.choice([-1.0, 1.0], size=q.shape)
    loads = np.unique(rows.payload) if rows.has_payload else rows.payload[-1:]
    n = len(q) * len(loads)
    last = rows.rows(np.full(n, len(rows) - 1))
    q, approach = (np.tile(values, (len(loads), 1)) for values in (q, approach))
    return replace(
        last,
        joints=q,
        previous=q - approach * 0.5,
        approach=approach,
        payload=np.repeat(loads, len(q) // len(loads)),
        time=last.time + _LATER * np.ptp(rows.time),
        lines=np.full(n, int(rows.lines.max()) + 1),
    )


@dataclass
class _Question:
    """One signal, and everything that may take its place."""

    weight: float
    signal: Float[Array, "pose 3"]
    known: Float[Array, "pose 3 column"]
    gram: Float[Array, "column column"]
    pulled: Float[Array, "column"]

    def gains(self) -> Float[Array, "pose"]:
        """How much of the signal no longer fits in when a pose is measured besides."""
        scale = 1.0 / np.sqrt(np.diag(self.gram))
        inverse = np.linalg.inv(self.gram * np.outer(scale, scale)) * np.outer(scale, scale)
        left = self.signal - self.known @ (inverse @ self.pulled)
        spread = np.eye(3) + self.known @ inverse @ np.swapaxes(self.known, 1, 2)
        solved = np.linalg.solve(spread, left[:, :, None])[:, :, 0]
        return np.asarray(self.weight * (left * solved).sum(axis=1))

    def take(self, pose: int) -> None:
        """Measure a pose."""
        K = self.known[pose]
        self.gram = self.gram + K.T @ K
        self.pulled = self.pulled + K.T @ self.signal[pose]


@dataclass(frozen=True)
class _Fitted:
    """A cause in the place in question: its columns on both kinds of rows, its coefficients."""

    measured: Float[Array, "scalar coefficient"]
    chosen: Float[Array, "pose 3 coefficient"]
    values: Float[Array, "coefficient"]
    precision: Float[Array, "coefficient"]
    """Of the prior."""


def _questions(
    rows: Circumstances, rest: Linearised, pool: _Pool, naming: Naming
) -> list[_Question]:
    """The leading cause against each rival and against nothing, and the rivals against it."""
    stated = naming.stated[: _MOST_RIVALS + 1]
    columns = [rest.columns(EFFECTS[c.instance.effect].moves(rows, c.instance)) for c in stated]
    found = []
    for cause, X in zip(stated, columns, strict=True):
        M, b = rest.scored(X)
        precision = cause.instance.prior_std**-2.0
        values = np.linalg.solve(M + np.diag(precision), b)
        found.append(_Fitted(X, pool.columns(cause.instance), values, precision))
    lead = found[0]
    questions = [_question(naming.none, rest, pool, lead, None)]
    for cause, rival in zip(stated[1:], found[1:], strict=True):
        questions.append(_question(cause.probability, rest, pool, lead, rival))
        questions.append(_question(cause.probability, rest, pool, rival, lead))
    return questions


def _question(
    weight: float, rest: Linearised, pool: _Pool, cause: _Fitted, rival: _Fitted | None
) -> _Question:
    measured, known, precision = rest.known, pool.known, rest.precision
    if rival is not None:
        measured = np.concatenate([measured, rival.measured], axis=1)
        known = np.concatenate([known, rival.chosen], axis=2)
        precision = np.concatenate([precision, rival.precision])
    gram = measured.T @ measured + np.diag(precision)
    pulled = measured.T @ (cause.measured @ cause.values)
    return _Question(weight, cause.chosen @ cause.values, known, gram, pulled)


def _greedy(questions: list[_Question], count: int) -> list[int]:
    """Poses that raise what the rivals cannot take up, the weighted sum of all questions."""
    chosen: list[int] = []
    for _ in range(count):
        value = np.sum([question.gains() for question in questions], axis=0)
        value[chosen] = -np.inf
        chosen.append(int(np.argmax(value)))
        for question in questions:
            question.take(chosen[-1])
    return chosen

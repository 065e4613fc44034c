"""Every candidate of the catalogue, scored after projection; searched families in one sweep each.

Listed effects are scored one by one. Steps are scored for all first rows at once by running sums.
Gear orders are scored on a grid fine enough that no peak falls between, by the same sums weighted
with cosine and sine. The scores of simulated noise go the same way, which gives the null.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Instance, revolute_joints, theta
from robocal.diagnosis.effects.gear_harmonic import GearHarmonic
from robocal.diagnosis.evidence import chi_square, log_bayes_factor, log_sum_exp
from robocal.diagnosis.linearised import Linearised

LOWEST_ORDER, HIGHEST_ORDER = 0.5, 400.0
"""Orders searched, cycles a turn; [1]"""
_OVERSAMPLING = 3.0
"""Grid points within one resolution of the order, which is one over the range in turns; [1]"""
_LISTED_ORDERS = (1.0, 2.0)
_SEARCHED_SHARE = 0.3
"""Prior share of gear harmonics at orders that are not 1 or 2; [1]"""
_STEPS = ("base_step", "tool_step", "encoder_step")
_CHUNK = 400


@dataclass(frozen=True)
class Group:
    """Candidates of one effect and joint: alternatives of which at most one is true.

    `M` and `b` are stacks over the candidates; `b` has one more axis where several residuals were
    scored together.
    """

    effect: str
    joint: int | None
    instances: tuple[Instance, ...]
    log_prior: Float[Array, "candidate"]
    """Log of each candidate's share of the effect's prior."""
    M: Float[Array, "candidate k k"]
    b: Float[Array, "candidate residual k"]

    @property
    def log_bf(self) -> Float[Array, "candidate residual"]:
        """Log Bayes factors against nothing more."""
        std = np.stack([instance.prior_std for instance in self.instances])
        return log_bayes_factor(self.M[:, None], self.b, std[:, None])

    @property
    def chi_square(self) -> Float[Array, "candidate residual"]:
        """Score statistics."""
        return chi_square(self.M[:, None], self.b)

    @cached_property
    def weighted(self) -> Float[Array, "candidate residual"]:
        """Log Bayes factors with the candidates' priors."""
        return np.asarray(self.log_bf + self.log_prior[:, None])


def screen(
    rows: Circumstances, fit: Linearised, residuals: Float[Array, "scalar residual"]
) -> list[Group]:
    """Score the whole catalogue against one or more whitened residuals.

    The residuals must be orthogonal to `Linearised.basis`: a fitted residual is,
    simulated noise is made so.
    """
    groups = list(_listed(rows, fit, residuals))
    groups += _steps(rows, fit, residuals)
    groups += _orders(rows, fit, residuals)
    return _share_priors(groups)


def _listed(
    rows: Circumstances, fit: Linearised, residuals: Float[Array, "scalar residual"]
) -> Iterator[Group]:
    """Effects whose instances are few."""
    for effect in EFFECTS.values():
        if effect.name in _STEPS:
            continue
        by_joint: dict[int | None, list[Instance]] = {}
        for instance in effect.instances(rows):
            by_joint.setdefault(instance.joint, []).append(instance)
        for joint, instances in by_joint.items():
            scored = []
            for instance in instances:
                X = fit.columns(effect.moves(rows, instance))
                inside = fit.basis.T @ X
                scored.append((X.T @ X - inside.T @ inside, residuals.T @ X))
            yield Group(
                effect.name,
                joint,
                tuple(instances),
                np.zeros(len(instances)),
                np.stack([M for M, _ in scored]),
                np.stack([b for _, b in scored]),
            )


def _steps(
    rows: Circumstances, fit: Linearised, residuals: Float[Array, "scalar residual"]
) -> Iterator[Group]:
    """All first rows of a step at once: sums from the last row back to each."""
    for name in _STEPS:
        effect = EFFECTS[name]
        by_joint: dict[int | None, list[Instance]] = {}
        for instance in effect.instances(rows):
            by_joint.setdefault(instance.joint, []).append(instance)
        for joint, instances in by_joint.items():
            # From the first row on everything has stepped: the columns without their start.
            ever = Instance(
                name, joint, (("line", float(rows.lines[0])),), instances[0].coefficients
            )
            X = fit.columns(effect.moves(rows, ever))
            k = X.shape[1]
            starts = np.searchsorted(
                rows.lines, [instance.argument("line") for instance in instances]
            )
            square = _from_row(fit, (X[:, :, None] * X[:, None, :]).reshape(len(X), -1), starts)
            inside = _from_row(
                fit, (fit.basis[:, :, None] * X[:, None, :]).reshape(len(X), -1), starts
            )
            inside = inside.reshape(len(starts), -1, k)
            score = _from_row(
                fit, (residuals[:, :, None] * X[:, None, :]).reshape(len(X), -1), starts
            )
            yield Group(
                name,
                joint,
                tuple(instances),
                np.full(len(instances), -np.log(len(instances))),
                square.reshape(-1, k, k) - np.swapaxes(inside, 1, 2) @ inside,
                score.reshape(len(starts), -1, k),
            )


def _from_row(
    fit: Linearised, values: Float[Array, "scalar some"], starts: Array
) -> Float[Array, "start some"]:
    """Sums over all scalars of the rows from each start on."""
    first = np.searchsorted(fit.row, np.arange(fit.n_rows))
    by_row = np.add.reduceat(values, first, axis=0)
    running = np.cumsum(by_row[::-1], axis=0)[::-1]
    return np.asarray(running[starts])


def order_grid(reading: Float[Array, "row"]) -> Float[Array, "order"]:
    """Orders to try for a joint that moved over these readings."""
    turns = max(np.ptp(reading) / (2 * np.pi), 0.05)
    return np.arange(LOWEST_ORDER, HIGHEST_ORDER, 1.0 / (_OVERSAMPLING * turns))


def _orders(
    rows: Circumstances, fit: Linearised, residuals: Float[Array, "scalar residual"]
) -> Iterator[Group]:
    """Gear harmonics of every joint at every order of the grid."""
    effect = EFFECTS["gear_harmonic"]
    assert isinstance(effect, GearHarmonic)
    for joint in revolute_joints(rows):
        reading = rows.joints[:, joint - 1]
        if np.ptp(reading) < 1e-3:
            continue
        orders = order_grid(reading)
        M, b = score_orders(rows, fit, residuals, joint, orders)
        yield Group(
            effect.name,
            joint,
            tuple(effect.at(joint, float(order)) for order in orders),
            np.full(len(orders), np.log(_SEARCHED_SHARE) - np.log(len(orders))),
            M,
            b,
        )


def score_orders(
    rows: Circumstances,
    fit: Linearised,
    residuals: Float[Array, "scalar residual"],
    joint: int,
    orders: Float[Array, "order"],
) -> tuple[Float[Array, "order 2 2"], Float[Array, "order residual 2"]]:
    """Information and scores of cosine and sine at each order."""
    first = np.searchsorted(fit.row, np.arange(fit.n_rows))
    u = fit.W[theta(joint, rows)]
    weight = np.add.reduceat(u * u, first)
    both = np.concatenate([fit.basis, residuals], axis=1)
    pulled = np.add.reduceat(u[:, None] * both, first, axis=0)
    n_known = fit.basis.shape[1]
    M, b = np.empty((len(orders), 2, 2)), np.empty((len(orders), residuals.shape[1], 2))
    reading = rows.joints[:, joint - 1]
    for start in range(0, len(orders), _CHUNK):
        part = slice(start, start + _CHUNK)
        phase = np.outer(orders[part], reading)
        waves = np.stack([np.cos(phase), np.sin(phase)], axis=1)  # (order, 2, row)
        square = np.einsum("okm,olm,m->okl", waves, waves, weight, optimize=True)
        seen = waves.reshape(-1, len(reading)) @ pulled
        seen = seen.reshape(-1, 2, both.shape[1])
        inside = seen[:, :, :n_known]
        M[part] = square - inside @ np.swapaxes(inside, 1, 2)
        b[part] = np.swapaxes(seen[:, :, n_known:], 1, 2)
    return M, b


def _share_priors(groups: list[Group]) -> list[Group]:
    """Spread each effect's prior of one over its joints, and over listed and searched orders."""
    joints: dict[str, set[int | None]] = {}
    for group in groups:
        joints.setdefault(group.effect, set()).add(group.joint)
    shared = []
    for group in groups:
        own = group.log_prior - np.log(len(joints[group.effect]))
        if group.effect == "gear_harmonic" and len(group.instances) == len(_LISTED_ORDERS):
            own = own + np.log((1.0 - _SEARCHED_SHARE) / len(_LISTED_ORDERS))
        elif group.effect not in _STEPS and group.effect != "gear_harmonic":
            own = own - np.log(len(group.instances))
        shared.append(Group(group.effect, group.joint, group.instances, own, group.M, group.b))
    return shared


def total_evidence(groups: list[Group]) -> Float[Array, "residual"]:
    """Log Bayes factor of "one cause of the catalogue" against "nothing more"."""
    n_families = len({group.effect for group in groups})
    all_weighted = np.concatenate([group.weighted for group in groups])
    each = np.array([log_sum_exp(column) for column in all_weighted.T])
    return np.asarray(each - np.log(n_families))


def null_threshold(
    rows: Circumstances, fit: Linearised, chance: float, draws: int, seed: int
) -> float:
    """Total evidence that noise alone exceeds with this chance.

    Estimated from simulated residuals, projected like real ones; the upper tail is taken as
    exponential beyond its upper tenth, so that few draws give a steady figure.
    """
    z = np.random.default_rng(seed).normal(size=(len(fit.r), draws))
    z -= fit.basis @ (fit.basis.T @ z)
    evidence = np.sort(total_evidence(screen(rows, fit, z)))
    tenth = evidence[int(0.9 * draws) :]
    scale = float(np.mean(tenth - tenth[0]))
    return float(tenth[0] + scale * np.log(0.1 / chance))

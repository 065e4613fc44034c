"""Every candidate of the catalogue, scored after projection; searched families in one sweep each.

Listed effects are scored one by one, steps for all first rows at once, gear orders on a grid fine
enough that no peak falls between. The scores of simulated noise go the same way, which gives the
null; see `alarm.py`.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.evidence import sizes_of
from robocal.diagnosis.group import Group, listed
from robocal.diagnosis.linearised import Linearised
from robocal.diagnosis.order_sweep import sweep_orders
from robocal.diagnosis.step_sweep import STEPS, sweep_steps

_SEARCHED_SHARE = 0.5
"""Prior share of gear harmonics at orders that are not 1 or 2; [1]"""
_LEAST_SHOWN = 0.01
"""Squared length, in noise, below which an effect of usual size cannot be seen; [1]"""


def screen(
    rows: Circumstances, fit: Linearised, residuals: Float[Array, "scalar residual"]
) -> list[Group]:
    """Score the whole catalogue against one or more whitened residuals.

    The residuals must be orthogonal to `Linearised.basis`: a fitted residual is,
    simulated noise is made so.
    """
    few = list(_listed(rows, fit, residuals))
    steps = list(sweep_steps(rows, fit, residuals))
    orders = [
        replace(group, log_prior=group.log_prior + np.log(_SEARCHED_SHARE))
        for group in sweep_orders(rows, fit, residuals)
    ]
    groups = [of_all_sizes(group) for group in (*few, *steps, *orders)]
    # Rows that show nothing at all leave every candidate as probable as nothing.
    return _shared_over_joints([group for group in groups if _shows(group)] or groups)


def _shows(group: Group) -> bool:
    """Whether any candidate moves the rows: one of a joint that stood still is no cause."""
    squares = np.einsum("nkk->nk", group.M) * group.prior_std**2
    return bool(squares.sum(axis=1).max() > _LEAST_SHOWN)


def _listed(
    rows: Circumstances, fit: Linearised, residuals: Float[Array, "scalar residual"]
) -> Iterator[Group]:
    """Effects whose instances are few."""
    for effect in EFFECTS.values():
        if effect.name in STEPS:
            continue
        instances = effect.instances(rows)
        if not instances:
            continue
        # Side by side: the basis of many rows is read once an effect, not once a candidate.
        X = np.concatenate([fit.columns(effect.moves(rows, i)) for i in instances], axis=1)
        inside, b = fit.basis.T @ X, residuals.T @ X
        M = X.T @ X - inside.T @ inside
        last = np.cumsum([len(instance.coefficients) for instance in instances])
        parts = [
            slice(end - len(i.coefficients), end) for i, end in zip(instances, last, strict=True)
        ]
        share = 1.0 - _SEARCHED_SHARE if effect.name == "gear_harmonic" else 1.0
        for joint in dict.fromkeys(instance.joint for instance in instances):
            here = [k for k, instance in enumerate(instances) if instance.joint == joint]
            yield Group(
                effect.name,
                joint,
                listed([instances[k] for k in here]),
                np.stack([instances[k].prior_std for k in here]),
                np.full(len(here), np.log(share / len(here))),
                np.stack([M[parts[k], parts[k]] for k in here]),
                np.stack([b[:, parts[k]] for k in here]),
                instances[here[0]].share,
            )


def of_all_sizes(group: Group) -> Group:
    """Every candidate with each of the sizes that it may have."""
    sizes = sizes_of(group.prior_std.shape[1])
    if len(sizes) == 1:
        return group
    count, n = len(sizes), len(group.log_prior)
    return replace(
        group,
        candidate=lambda position: group.candidate(position % n).of_size(sizes[position // n]),
        prior_std=np.concatenate([group.prior_std * size for size in sizes]),
        log_prior=np.tile(group.log_prior - np.log(count), count),
        M=np.tile(group.M, (count, 1, 1)),
        b=np.tile(group.b, (count, 1, 1)),
    )


def _shared_over_joints(groups: list[Group]) -> list[Group]:
    """Spread each effect's prior of one over its joints, by their weights."""
    weights: dict[str, dict[int | None, float]] = {}
    for group in groups:
        weights.setdefault(group.effect, {})[group.joint] = group.share
    return [
        replace(
            group,
            log_prior=group.log_prior + np.log(group.share / sum(weights[group.effect].values())),
        )
        for group in groups
    ]


def evidence_by_name(
    groups: list[Group],
) -> dict[tuple[str, int | None], Float[Array, "residual"]]:
    """Log evidence of every effect and joint against nothing more, families being as probable."""
    n_families = len({group.effect for group in groups})
    names: dict[tuple[str, int | None], list[Float[Array, "candidate residual"]]] = {}
    for group in groups:
        names.setdefault((group.effect, group.joint), []).append(group.weighted)
    return {
        name: np.logaddexp.reduce(np.concatenate(weighted), axis=0) - np.log(n_families)
        for name, weighted in names.items()
    }

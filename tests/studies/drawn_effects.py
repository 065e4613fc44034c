"""Many hidden effects at one arm and campaign: what each adds to the readings, whitened.

Geometry about the true arm has the law it is drawn by, base and tool may be anywhere. With W the
inverse covariance of the readings under noise and that geometry, an effect that adds d is seen as
root(W) d in unit noise.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drivers.emulators.blind_case import GEOMETRY, Case, Options, draw_case
from drivers.emulators.robot_file import read_robot
from drivers.emulators.visibility import (
    difference,
    frame_columns,
    geometry_basis,
    link_columns,
    orthonormal,
    visibility,
)

_PIECE = 200
"""Readings at a time."""


@dataclass(frozen=True)
class Place:
    """One arm and campaign with effects that might be hidden there."""

    strength: np.ndarray
    """Lambda of every effect, (effect,)."""
    shift: np.ndarray
    """Root of W times what the effect adds, (effect, scalar)."""
    name: np.ndarray
    """Effect and joint, (effect,)."""
    probed: np.ndarray
    """Whether the arm's temperature is read with this effect, (effect,)."""


def place(robot: Path, seed: int, index: int, effects: int, kind: str = "one") -> Place:
    """Draw many effects at one arm and campaign."""
    arm, where = read_robot(robot), Options(seed, index, kind)
    first = draw_case(arm, where)
    fit, q = ~first.campaign.check, first.campaign.q
    basis = geometry_basis(first.cell, q[fit], where.sigma)
    root = _root_of_weight(first)
    strengths, shifts, names, probed = [], [], [], []
    for number in range(effects):
        case = draw_case(arm, Options(seed, number, kind), where)
        now = case.campaign.circumstances()
        added = difference(case.cell, case.without(0), q, now, where.sigma)
        strengths.append(visibility(added, basis, fit).strength)
        shifts.append(root @ added[fit].ravel())
        names.append(_name(case))
        probed.append(case.has_probe)
    return Place(np.array(strengths), np.array(shifts), np.array(names), np.array(probed))


def _name(case: Case) -> str:
    (hidden,) = case.hidden
    places = (hidden.entries.get(place) for place in ("joint", "driven_by"))
    return " ".join([hidden.effect, *(str(place) for place in places if place is not None)])


def _root_of_weight(case: Case) -> np.ndarray:
    """Symmetric root of W: geometry has the law it is drawn by, the frames may be anywhere."""
    q, sigma = case.campaign.q[~case.campaign.check], case.options.sigma
    J, angles = link_columns(case.cell, q, sigma)
    J = J * np.where(angles, GEOMETRY.angle_mrad, GEOMETRY.length_mm) * 1e-3
    frames = orthonormal(frame_columns(case.cell, q, sigma))
    J -= frames @ (frames.T @ J)
    U, s, _ = np.linalg.svd(J, full_matrices=False)
    without = np.eye(len(J)) - frames @ frames.T
    return without - (U * (1.0 - 1.0 / np.hypot(1.0, s))) @ U.T


def likelihoods(known: np.ndarray, readings: np.ndarray) -> Iterator[np.ndarray]:
    """Log likelihood ratios of effects against none, some whitened readings at a time."""
    half = 0.5 * (known**2).sum(axis=1, keepdims=True)
    for part in np.array_split(readings, max(1, len(readings.T) // _PIECE), 1):
        yield known @ part - half

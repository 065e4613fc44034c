"""Errors of links, base and tool.

In their other form a beam is bent by its end force too, links grow unevenly, drift comes to rest.
"""

import numpy as np

from tests.second_world.arm import G, N, moment_about
from tests.second_world.campaign import Campaign, Change
from tests.second_world.draw import Draw, Hidden

UPPER_ARM = 2
EXPANSION_PER_K = 23e-6


def link_bending(draw: Draw) -> Hidden:
    """The upper arm bends by the moment at its end; in the other form as a beam, by the force too.

    The end turns by L/EI M + L^2/2EI F and sags by L^2/2EI M + L^3/3EI F; size is L/EI.
    """
    link = draw.joint((UPPER_ARM,))
    size = draw.size(1e-6, 6e-6)

    def act(at: Campaign, change: Change) -> None:
        R, end = at.R[:, link], at.o[:, link]

        def inside(v: np.ndarray) -> np.ndarray:
            return np.einsum("nji,nj->ni", R, v)

        M = inside(moment_about(end, at.where, at.weights, at.down, link))
        L = inside(end - at.o[:, link - 1])
        along = L / np.linalg.norm(L, axis=1)[:, None]
        M = M - (M * along).sum(axis=1)[:, None] * along
        F = inside(at.weights[:, link:].sum(axis=1)[:, None] * G * at.down) * draw.other
        of_force = np.cross(L, F)
        sag = np.cross(M / 2 + of_force / 3, L)
        change.bent[link - 1] = (size * (M + of_force / 2), size * sag)

    return Hidden("link_bending", act, link)


def base_compliance(draw: Draw) -> Hidden:
    """The pedestal tilts with the moment about its foot."""
    size = draw.size(1e-6, 10e-6)

    def act(at: Campaign, change: Change) -> None:
        change.tilt += size * at.overturning * [1, 1, 0]

    return Hidden("base_compliance", act)


def thermal_expansion(draw: Draw) -> Hidden:
    """Links grow; in the other form each by up to 40 % more or less than the mean."""
    size = EXPANSION_PER_K * draw.size(0.5, 1.5)
    share = 1 + draw.other * 0.4 * draw.rng.uniform(-1, 1, N)

    def act(at: Campaign, change: Change) -> None:
        change.growth += size * at.warmer[:, None] * share

    return Hidden("thermal_expansion", act)


def step(draw: Draw) -> tuple[np.ndarray, np.ndarray]:
    """Which rows come after it, and how far it goes."""
    size, along = draw.size(0.05e-3, 0.5e-3), draw.direction()
    n = draw.campaign.n
    first = int(draw.rng.integers(round(0.15 * n), round(0.85 * n)))
    return np.arange(n)[:, None] >= first, size * along


def tool_step(draw: Draw) -> Hidden:
    """The nest slips on the flange."""
    after, slip = step(draw)

    def act(at: Campaign, change: Change) -> None:
        change.slip += after * slip

    return Hidden("tool_step", act)


def base_step(draw: Draw) -> Hidden:
    """Robot or tracker are knocked."""
    after, shift = step(draw)

    def act(at: Campaign, change: Change) -> None:
        change.shift += after * shift

    return Hidden("base_step", act)


def base_drift(draw: Draw) -> Hidden:
    """The station wanders; in the other form it comes to rest."""
    size, along = draw.size(0.05e-3, 0.4e-3), draw.direction()

    def act(at: Campaign, change: Change) -> None:
        u = at.elapsed
        gone = (1 - np.exp(-4 * u)) / (1 - np.exp(-4)) if draw.other else u
        change.shift += gone[:, None] * size * along

    return Hidden("base_drift", act)

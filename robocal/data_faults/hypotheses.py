"""Which slips of joints, unit and mirror let the nominal robot fit its points."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.data_faults.campaign_view import View
from robocal.data_faults.frame_fits import (
    LooseFits,
    RigidFit,
    global_start,
    loose_fits,
    rigid_fits,
    spread_of,
)
from robocal.data_faults.joints import AS_WRITTEN, JointSlip
from robocal.data_faults.lengths import length_slip, nearest_factor
from robocal.data_faults.mirror import POSITIONS_MIRRORED, Z_TURNED
from robocal.data_faults.slip import Slip
from robocal.identification.frames_start import nominal_flange
from robocal.robots.robot import Robot

CLEAR_GAIN = 3.0
"""A slip is named if its mend makes the misfit smaller by this factor"""
CERTAINLY_CLEAN = 0.05
"""Share of the plausible error below which nothing is tried"""
RIVAL = 1.5
"""Another mend within this factor is as good"""
_ROWS = 60
_MOST_CLOSE = 12
_CLOSE = 5.0
"""A free matrix flatters; what it likes this much less than the best is not tried further"""
_WORST_MISFIT = 0.15
"""Points miss by less than this share of their spread, whatever the robot"""


@dataclass(frozen=True)
class Candidate:
    """Rows, and what is thought to be wrong with their joints."""

    view: View
    joints: JointSlip


@dataclass(frozen=True)
class Explanation:
    """Slips under which the nominal robot fits."""

    candidate: Candidate
    factor: float
    mirrored: bool
    fit: RigidFit
    misfit: float
    """Score over the spread of the points [1]"""

    @property
    def slips(self) -> tuple[Slip, ...]:
        """What is wrong, in the order of mending."""
        lengths = () if self.factor == 1.0 else (length_slip(self.factor),)
        mirror = (POSITIONS_MIRRORED,) if self.mirrored else ()
        return (*self.candidate.joints.slips, *lengths, *mirror)


def plausible_error(robot: Robot) -> float:
    """What a nominal robot may miss its points by, frames fitted: 2 % of its length [m]."""
    return 0.02 * chain_length(robot)


def chain_length(robot: Robot) -> float:
    """Sum of all link lengths and strokes [m]."""
    links, slides = robot.geometry.links, robot.geometry.prismatic
    strokes = np.ptp(robot.limits[slides], axis=1).sum()
    return float(np.hypot(links[:, 1], links[:, 2]).sum() + strokes)


def as_written(view: View) -> Explanation:
    """The best fit of the data as they stand."""
    candidate = Candidate(view, AS_WRITTEN)
    R, P, p, place = _stack([candidate])
    start = loose_fits(R, P, p, place).matrix
    spread = spread_of(p[0])
    fit = rigid_fits(R, P, p, place, start)[0]
    if fit.score > CERTAINLY_CLEAN * plausible_error(view.robot):
        weight = np.ones(len(view))
        start = global_start(R[0], P[0], p[0], place[0], weight)[None]
        other = rigid_fits(R, P, p, place, start)[0]
        fit = min(fit, other, key=lambda one: one.score)
    return Explanation(candidate, 1.0, mirrored=False, fit=fit, misfit=fit.score / spread)


def explain(candidates: Sequence[Candidate], misfit: float) -> tuple[Explanation, ...]:
    """The best of the explanations that beat `misfit` clearly, then those that are as good.

    Fewer slips go before a better fit: any frame can be mirrored twice.
    """
    candidates = [Candidate(c.view.evenly(_ROWS), c.joints) for c in candidates]
    found: list[Explanation] = []
    for size in {len(c.view) for c in candidates}:
        found += _explanations([c for c in candidates if len(c.view) == size], misfit)
    if not found:
        return ()
    fewest = min(len(one.slips) for one in found)
    found = sorted((one for one in found if len(one.slips) == fewest), key=lambda o: o.misfit)
    return tuple(one for one in found if one.misfit <= RIVAL * found[0].misfit)


def _stack(
    candidates: Sequence[Candidate],
) -> tuple[
    Float[Array, "hypothesis row 3 3"],
    Float[Array, "hypothesis row 3"],
    Float[Array, "hypothesis row 3"],
    Int[Array, "hypothesis row"],
]:
    """Flange rotations, flange points, measured points and their targets; all of equal length."""
    whole: dict[tuple[int, int], Float[Array, "every joint"]] = {}
    joints = []
    for candidate in candidates:
        key = (id(candidate.view.rows), id(candidate.joints))
        if key not in whole:
            whole[key] = candidate.joints.joints(candidate.view.rows)
        joints.append(whole[key][candidate.view.moved])
    geometry = candidates[0].view.robot.geometry
    T = nominal_flange(geometry, np.concatenate(joints)).reshape(len(candidates), -1, 4, 4)
    points = np.stack([candidate.view.points for candidate in candidates])
    places = np.stack([candidate.view.places for candidate in candidates])
    return T[..., :3, :3], T[..., :3, 3], points, places


def _explanations(candidates: Sequence[Candidate], misfit: float) -> list[Explanation]:
    """Loose fits choose, rigid fits with the units and mirrors that these show decide."""
    R, P, p, place = _stack(candidates)
    loose = loose_fits(R, P, p, place)
    enough = min(misfit / (CLEAR_GAIN - 0.5), _CLOSE * loose.misfit.min())
    close = np.flatnonzero(loose.misfit <= enough)
    close = close[np.argsort(loose.misfit[close])][:_MOST_CLOSE]
    found = []
    for index in close.tolist():
        for factor in {1.0, nearest_factor(_scale(loose, index))}:
            for mirrored in (False, True):
                points = p[index] * factor @ (Z_TURNED if mirrored else np.eye(3))
                own = slice(index, index + 1)
                weight = loose.weight[index]
                start = global_start(R[index], P[index], points, place[index], weight)[None]
                fit = rigid_fits(R[own], P[own], points[None], place[own], start)[0]
                one = Explanation(
                    candidates[index], factor, mirrored, fit, fit.score / spread_of(points)
                )
                if _holds(one, misfit):
                    found.append(one)
    return found


def _scale(loose: LooseFits, index: int) -> float:
    """Size of the free matrix, by its best determined direction but one."""
    return float(np.linalg.svd(loose.matrix[index], compute_uv=False)[1])


def _holds(one: Explanation, misfit: float) -> bool:
    robot = one.candidate.view.robot
    return one.fit.score <= plausible_error(robot) and one.misfit <= min(
        misfit / CLEAR_GAIN, _WORST_MISFIT
    )


def with_rivals(ways: Sequence[tuple[Slip, ...]]) -> tuple[Slip, ...]:
    """The first way to mend the data; where others are as good, its last slip says so."""
    best = ways[0]
    own = _sentence(best)
    rivals = tuple(dict.fromkeys(text for text in map(_sentence, ways[1:]) if text != own))
    if not rivals or not best:
        return best
    return (*best[:-1], replace(best[-1], rivals=rivals))


def _sentence(slips: tuple[Slip, ...]) -> str:
    return " and ".join(slip.sentence for slip in slips)


def unseen(explanation: Explanation, slips: Sequence[JointSlip]) -> tuple[Explanation, ...]:
    """One more slip that the points do not mind: on an axis, say, or in a small volume."""
    if explanation.slips:
        return ()
    view = explanation.candidate.view.evenly(_ROWS)
    found = []
    for joints, mirrored in (*((one, False) for one in slips), (AS_WRITTEN, True)):
        R, P, p, place = _stack([Candidate(view, joints)])
        points = p[0] @ (Z_TURNED if mirrored else np.eye(3))
        start = global_start(R[0], P[0], points, place[0], np.ones(len(view)))
        fit = rigid_fits(R, P, points[None], place, start[None])[0]
        # Small volumes are fitted wrongly as well, but not better than by the truth.
        if fit.score <= RIVAL * explanation.fit.score:
            misfit = fit.score / spread_of(points)
            found.append(Explanation(Candidate(view, joints), 1.0, mirrored, fit, misfit))
    return tuple(found)

"""In which other forms an effect of gravity or heat may act: what its stated form leaves open.

Masses and their centres are stated roughly, a spring hardens, a pedestal or a link may be stiffer
one way than the other, and no two links grow alike. To first order each is one more column beside
the effect's own, known to about its prior; what these columns can take up is no sign of another
cause.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Follows, Moves
from robocal.diagnosis.extended import FittedEffect, moves_of
from robocal.diagnosis.linearised import Linearised
from robocal.robots.robot import LinkMass

MASS_SPREAD = 0.1
"""Standard deviation of a stated mass, and of its centre's place over its distance; [1]"""
HAND_SPREAD = 0.015
"""Of the payload's centre about the place where it is thought to hang, an axis [m]"""
HARDENING = 1.0 / 3.0
"""Of what a spring yields under its largest load h: the cubic term of h tanh(tau/h); [1]"""
ONE_WAY = 0.5
"""Of the compliance or growth: what one direction or link may have more than the other; [1]"""
_GROWTH = ("thermal_expansion", "warm_up")


def other_forms(rows: Circumstances, effects: tuple[FittedEffect, ...]) -> list[Moves]:
    """What each other form adds to the parameters of a row, by one standard deviation of it.

    Parameters
    ----------
    rows
        Rows that the effects act on.
    effects
        Of one place. Empty for what follows the load of masses that are not stated, and for what
        neither load nor heat drives.
    """
    name = effects[0].instance.effect
    stated = moves_of(rows, effects)
    one_way: list[Moves] = [{parameter: ONE_WAY * move} for parameter, move in stated.items()]
    if name in _GROWTH:
        return one_way
    if EFFECTS[name].follows is not Follows.load or rows.robot.masses is None:
        return []
    added = one_way
    for other in _other_loads(rows):
        moved = moves_of(other, effects)
        added.append({parameter: moved[parameter] - stated[parameter] for parameter in stated})
    for parameter, move in stated.items():
        largest = max(float(np.abs(move).max()), 1e-300)
        added.append({parameter: HARDENING * move * (move / largest) ** 2})
    return added


def beside_forms(rest: Linearised, other: list[Moves]) -> Linearised:
    """A fit at its minimum that has taken up what it could by other forms of what acts there."""
    forms = np.concatenate([rest.columns(moves) for moves in other], axis=1)
    free = replace(
        rest,
        more=np.concatenate([rest.more, forms], axis=1),
        more_precision=np.concatenate([rest.more_precision, np.ones(forms.shape[1])]),
    )
    # At the minimum the priors pull as the data do; the forms start from their means.
    pull = np.concatenate([rest.known.T @ rest.r, np.zeros(forms.shape[1])])
    return replace(free, r=free.refitted(rest.r, pull))


def _other_loads(rows: Circumstances) -> Iterator[Circumstances]:
    """The rows with one mass, or one coordinate of its centre, a standard deviation off."""
    masses = rows.robot.masses or ()
    for number, link in enumerate(masses):
        for other in _off(link):
            changed = (*masses[:number], other, *masses[number + 1 :])
            yield replace(rows, robot=replace(rows.robot, masses=changed))
    if np.nan_to_num(rows.payload).any():
        for axis in np.eye(3):
            yield replace(rows, tool_place=rows.tool_place + HAND_SPREAD * axis)


def _off(link: LinkMass) -> Iterator[LinkMass]:
    if link.mass == 0.0:
        return
    yield replace(link, mass=link.mass * (1.0 + MASS_SPREAD))
    spread = MASS_SPREAD * float(np.linalg.norm(link.centre))
    for axis in np.eye(3):
        x, y, z = np.array(link.centre) + spread * axis
        yield replace(link, centre=(x, y, z))

"""What is known of each parameter before any measurement."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.errors import BadInput
from robocal.formats.fields import LEAST_DEVIATION
from robocal.identification.cell_model import CellModel
from robocal.kinematics.model import FRAME_PARAMETERS, LINK_IS_ANGLE, LINK_PARAMETERS

PRIOR_LENGTH = 1e-3
"""How far a link length may be off its nominal value, one standard deviation [m]"""
PRIOR_ANGLE = 5e-3
"""The same for a link angle [rad]"""

WIDE_LENGTH = 10.0
"""The same for frames, nests and the anchor, about their closed-form start: no constraint, but it
keeps directions in check that only the robot's own skewness shows [m]"""
WIDE_ANGLE = 10.0
"""[rad]"""


@dataclass(frozen=True)
class Choices:
    """What the user wants done with single parameters, by name.

    Parameters
    ----------
    fixed
        Kept at the nominal value.
    free
        Identified without any prior.
    prior_std
        Own standard deviations about the nominal value [m, rad].
    """

    fixed: frozenset[str] = frozenset()
    free: frozenset[str] = frozenset()
    prior_std: dict[str, float] = field(default_factory=dict)

    def overruled_by(self, later: "Choices") -> "Choices":
        """Both together; where they speak of the same parameter the later word counts."""
        said = later.fixed | later.free | later.prior_std.keys()
        own = {name: std for name, std in self.prior_std.items() if name not in said}
        return Choices(
            (self.fixed - said) | later.fixed,
            (self.free - said) | later.free,
            {**own, **later.prior_std},
        )

    def speaks_of(self, name: str) -> bool:
        """Whether the parameter is asked to move in a way of its own."""
        return name in self.free or name in self.prior_std

    def without_free(self, names: Iterable[str]) -> "Choices":
        """The same with these parameters no longer free of their default priors."""
        return replace(self, free=self.free.difference(names))

    def check(self, names: tuple[str, ...]) -> None:
        """Complain about a name that is no parameter, or that is asked for twice.

        Raises
        ------
        BadInput
            Naming it and some that exist.
        """
        for name in (*self.fixed, *self.free, *self.prior_std):
            if name not in names:
                example = ", ".join((*names[:3], *names[-2:]))
                raise BadInput(
                    f"parameter '{name}'", f"is none of this cell's parameters, e.g. {example}"
                )
        for name in self.fixed & (self.free | self.prior_std.keys()):
            raise BadInput(f"parameter '{name}'", "cannot be both fixed and free")


def own_prior(key: str, value: float) -> tuple[str, float]:
    """Name and standard deviation [m, rad] of a prior given as `a_2_mm` or `theta_3_deg`.

    Raises
    ------
    ValueError
        If the unit is missing or not the parameter's, or the value is no sensible size.
    """
    name, _, unit = key.rpartition("_")
    if unit not in ("mm", "deg"):
        raise ValueError("must end in _mm or _deg")
    own = _unit(name)
    if own is not None and unit != own:
        raise ValueError(f"{name} is in {own}, so it must end in _{own}")
    if not LEAST_DEVIATION <= value < float("inf"):
        raise ValueError(f"must be positive, {LEAST_DEVIATION:g} or more, not {value:g}")
    return name, value * (1e-3 if unit == "mm" else np.pi / 180.0)


def _unit(name: str) -> str | None:
    """Unit of a link's or a frame's parameter; None for a name that is neither's."""
    kind, _, which = name.partition("_")
    if kind in LINK_PARAMETERS and which.isdecimal():
        return "deg" if LINK_IS_ANGLE[LINK_PARAMETERS.index(kind)] else "mm"
    if kind in ("base", "tool") and which in FRAME_PARAMETERS:
        return "mm" if which in FRAME_PARAMETERS[:3] else "deg"
    return None


def choices_of(fixed: list[str], free: list[str], priors: list[str]) -> Choices:
    """Choices as a command line gives them; priors as `a_2_mm=0.2`.

    Raises
    ------
    BadInput
        If a prior is no `NAME_UNIT=NUMBER`, or two are of one parameter.
    """
    prior_std: dict[str, float] = {}
    for text in priors:
        key, _, value = text.partition("=")
        try:
            name, std = own_prior(key, _number(value))
        except ValueError as error:
            raise BadInput(f"prior '{text}'", f"must look like a_2_mm=0.2: {error}") from None
        if name in prior_std:
            raise BadInput(f"prior '{text}'", f"is the second one of {name}; give one")
        prior_std[name] = std
    return Choices(frozenset(fixed), frozenset(free), prior_std)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        said = f"'{text}' is no number" if text else "its value is missing"
        raise ValueError(f"{said}, NAME=VALUE is wanted") from None


def prior_std(cell: CellModel, choices: Choices) -> Float[Array, "parameter"]:
    """Standard deviation of every parameter [m, rad]: zero where fixed, infinite where free.

    Links get the defaults; frames, nests and the anchor are as good as unknown.
    """
    n_links = 5 * cell.geometry.n_joints
    std = np.where(cell.is_angle, WIDE_ANGLE, WIDE_LENGTH)
    std[:n_links] = np.where(cell.is_angle[:n_links], PRIOR_ANGLE, PRIOR_LENGTH)
    for index, name in enumerate(cell.names):
        if name in choices.fixed:
            std[index] = 0.0
        elif name in choices.free:
            std[index] = np.inf
        elif name in choices.prior_std:
            std[index] = choices.prior_std[name]
    return std


def prior_centre(cell: CellModel, start: CellModel, choices: Choices) -> CellModel:
    """Where the priors are centred: own ones where the start was, all others where the cell is.

    A start has the campaign's value of what an own prior speaks of.
    """
    vector = cell.vector
    own = [cell.names.index(name) for name in choices.prior_std]
    vector[own] = start.vector[own]
    return cell.with_vector(vector)

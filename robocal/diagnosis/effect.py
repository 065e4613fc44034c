r"""What an effect is: small moves of the robot's own parameters, row by row.

Every effect of the catalogue, from a yielding joint to a drifting station, changes the geometric
parameters of a row by :math:`\delta\theta_p(row) = \sum_k D_{p,k}(row)\,c_k`: a yielding joint
moves theta of its link, thermal growth moves a and d, a slipped nest moves the tool, a drifting
station the base. So one Jacobian serves all, and a model with effects predicts by the same forward
kinematics with parameters of its own for every row.
"""

from dataclasses import dataclass, field, replace
from enum import StrEnum, auto
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.circumstances import Circumstances

Moves = dict[int, Float[Array, "row coefficient"]]
"""By index of the geometric parameter: its change for a coefficient of one [m, rad]."""


class Follows(StrEnum):
    """What an effect follows: a wrong form of it follows the same."""

    angle = auto()
    """Of one joint."""
    load = auto()
    motion = auto()
    """How the arm came to its pose."""
    time = auto()
    """Time or temperature, wherever the arm stands."""
    sight = auto()
    """From where the instrument sees the target."""


PLACES = ("order", "line", "driven_by")
"""Arguments that say where an effect acts; the others say in which form."""


@dataclass(frozen=True)
class Coefficient:
    """One number of an effect."""

    name: str
    """With its unit: `compliance_rad_per_nm`."""
    prior_std: float = field(compare=False)
    """Physical size, one standard deviation about zero; how large it may be is not what it is."""


@dataclass(frozen=True)
class Instance:
    """An effect at a place: its arguments chosen, its coefficients open.

    `joint` counts from 1. `arguments` holds what else tells it from its siblings: the order of a
    gear, the line of a step, a time constant.
    """

    effect: str
    joint: int | None
    arguments: tuple[tuple[str, float], ...]
    coefficients: tuple[Coefficient, ...]
    share: float = field(default=1.0, compare=False)
    """Prior weight of its joint among those of the effect; [1]"""

    def argument(self, name: str) -> float:
        """One of the arguments."""
        return dict(self.arguments)[name]

    def of_size(self, share: float) -> "Instance":
        """The same with a share of its priors."""
        own = self.coefficients
        smaller = tuple(replace(each, prior_std=each.prior_std * share) for each in own)
        return replace(self, coefficients=smaller)

    @property
    def place(self) -> tuple[object, ...]:
        """What two forms of one cause agree in."""
        where = (pair for pair in self.arguments if pair[0] in PLACES)
        return self.effect, self.joint, *where

    @property
    def prior_std(self) -> Float[Array, "coefficient"]:
        """Of all coefficients."""
        return np.array([coefficient.prior_std for coefficient in self.coefficients])

    @property
    def title(self) -> str:
        """For people: `gear_harmonic J2 order 100`."""
        joint = () if self.joint is None else (f"J{self.joint}",)
        return " ".join((self.effect, *joint, *self.details))

    @property
    def details(self) -> tuple[str, ...]:
        """The arguments for people."""
        given = dict(self.arguments)
        line, before = given.get("line"), given.pop("last_line_before", None)
        texts = {name: f"{name} {value:.4g}" for name, value in given.items()}
        if line is not None:
            gap = before is not None and before < line - 1
            texts["line"] = (
                f"between lines {before:.0f} and {line:.0f}" if gap else f"line {line:.0f}"
            )
        return tuple(texts.values())


@runtime_checkable
class Effect(Protocol):
    """A physical effect; one a file under `effects/`."""

    name: str
    follows: Follows
    advice: str
    """What to do at the machine, one sentence."""
    needs: str
    """Columns without which it cannot be seen, for people; empty if none."""

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act, empty where the rows lack what it needs."""
        ...

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        ...


def theta(joint: int, rows: Circumstances) -> int:
    """Index of the parameter that the reading of joint (from 1) adds to."""
    return 5 * (joint - 1) + int(rows.robot.geometry.prismatic[joint - 1])


def unit(joint: int, rows: Circumstances) -> str:
    """What the reading of joint (from 1) is counted in."""
    return "m" if rows.robot.geometry.prismatic[joint - 1] else "rad"


def base_index(rows: Circumstances) -> int:
    """Index of base_x."""
    return 5 * rows.n_joints


def tool_index(rows: Circumstances) -> int:
    """Index of tool_x."""
    return 5 * rows.n_joints + 6


def column(values: Float[Array, "row"]) -> Float[Array, "row 1"]:
    """One coefficient's changes."""
    return np.ascontiguousarray(values)[:, None]


def revolute_joints(rows: Circumstances) -> list[int]:
    """Numbers of the revolute joints, from 1."""
    return [j + 1 for j in range(rows.n_joints) if not rows.robot.geometry.prismatic[j]]

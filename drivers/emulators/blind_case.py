"""One hidden case: a true cell, what is wrong with it, and a campaign measured on it.

A case is drawn from its seed alone, so it can be made again and measured further.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from drivers.emulators.campaign_draw import Campaign, Size, draw_campaign
from drivers.emulators.drawing import disturbed_links, draw_base, draw_tool
from drivers.emulators.effects import read_effect
from drivers.emulators.hidden_cell import HiddenCell
from drivers.emulators.measured_rows import Reading
from drivers.emulators.records import WorldError
from drivers.emulators.rigid import small_turn
from drivers.emulators.robot_file import NominalRobot
from drivers.emulators.size_draw import SIZES, Scene
from drivers.emulators.stance import Load, Stance
from drivers.emulators.true_arm import STANDARD_GRAVITY, MassPoint
from drivers.emulators.unlisted_draw import CAUSES
from drivers.emulators.visibility import Sigma
from drivers.emulators.world_config import GeometryError

KINDS = ("clean", "one", "other_forms", "two", "background", "absent", "data_fault")
INVISIBLE = "instrument_scale"
"""All lengths of the arm take it up exactly: never drawn as the cause to find."""
SIDES = "load_backlash"
"""Needs a joint whose load changes side; a SCARA has none."""
BACKGROUND = 0.25
"""Size of the other effects in the kind `background`; [1]"""
WITHOUT_PROBE = {"warm_up"}
"""Effects that are what they are only where no probe reads the arm's temperature."""
WITH_PROBE = {"thermal_expansion", "joint_thermal_drift"}
RANGE_NOISE = "range_noise"
GEOMETRY = GeometryError(length_mm=0.3, angle_mrad=3.0)
MASS_SPREAD = 0.1
"""Standard deviation of true masses and centres about those in robot.yaml, relative; [1]"""
PAYLOAD_SPREAD = 0.015
"""Of the payload's centre about the target, per axis [m]."""
PLACE = ("links", "frames", "campaign")
"""What cases of one place have in common."""
REVERSING = 0.1
"""A joint's load changes side if it does so in this share of the rows; [1]"""


@dataclass(frozen=True)
class Options:
    """What a case is drawn from."""

    seed: int
    index: int
    kind: str
    size: Size = field(default_factory=Size)
    factor: float = 1.0
    """On the sizes of all effects."""
    effect: str | None = None
    """The effect to hide; None draws it."""
    orientation: bool = False
    """Whether full poses are read."""
    sigma_mm: float = 0.03
    sigma_mrad: float = 0.05

    @property
    def sigma(self) -> Sigma:
        """The noise, in SI units."""
        return Sigma(self.sigma_mm * 1e-3, self.sigma_mrad * 1e-3 if self.orientation else None)


@dataclass(frozen=True)
class Hidden:
    """One effect in its JSON form."""

    effect: str
    entries: Mapping[str, Any]
    main: bool = True
    """Whether the case is about it; the others are background."""


@dataclass(frozen=True)
class Case:
    """The truth, and the campaign that was measured."""

    options: Options
    robot: NominalRobot
    cell: HiddenCell
    campaign: Campaign
    hidden: tuple[Hidden, ...]
    """In the order of `cell.effects`."""
    covariates: tuple[str, ...]
    kindred: tuple[tuple[str, int | None], ...]
    noise_ppm: float
    """Noise that grows with range, which campaign.yaml does not state."""

    @property
    def has_probe(self) -> bool:
        """Whether the arm's temperature is read."""
        return not any(h.main and h.effect in WITHOUT_PROBE for h in self.hidden)

    def without(self, position: int) -> HiddenCell:
        """Return the true cell less one effect."""
        effects = self.cell.effects
        return replace(self.cell, effects=effects[:position] + effects[position + 1 :])

    def read(self, campaign: Campaign) -> Reading:
        """Measure a campaign; rows that it shares with another one read the same in both."""
        T = self.cell.target_pose(campaign.q, campaign.circumstances(), np.zeros_like(campaign.q))
        position, sigma = self.cell.seen(T), self.options.sigma
        shaken, turned = (np.random.default_rng(s) for s in _seeds(self.options)["noise"].spawn(2))
        distance = np.linalg.norm(position, axis=1, keepdims=True)
        scale = np.hypot(sigma.position, self.noise_ppm * 1e-6 * distance)
        position = position + shaken.normal(size=position.shape) * scale
        if sigma.orientation is None:
            return Reading(position, None)
        turn = small_turn(turned.normal(size=position.shape) * sigma.orientation)
        return Reading(position, turn @ T[..., :3, :3])


def _seeds(options: Options) -> dict[str, np.random.SeedSequence]:
    names = ("links", "masses", "frames", "campaign", "effects", "noise", "slip")
    root = np.random.SeedSequence([options.seed, options.index, KINDS.index(options.kind)])
    return dict(zip(names, root.spawn(len(names)), strict=True))


def slip_draw(options: Options) -> np.random.Generator:
    """Draws for the fault of the data."""
    return np.random.default_rng(_seeds(options)["slip"])


def draw_case(robot: NominalRobot, options: Options, where: Options | None = None) -> Case:
    """Draw everything that the seed leaves open.

    Parameters
    ----------
    where
        Options of a case whose arm, frames and campaign to take, with masses and effects of
        one's own; the same options if None.

    Raises
    ------
    WorldError
        If the robot's file has no masses, or the kind is unknown.
    """
    if not robot.masses:
        raise WorldError("config", "the robot's file has no links with masses; add them.")
    if options.kind not in KINDS:
        raise WorldError("config", f"kind {options.kind!r} is not one of {', '.join(KINDS)}.")
    seeds = {**_seeds(options), **{name: _seeds(where or options)[name] for name in PLACE}}
    draws = {name: np.random.default_rng(seed) for name, seed in seeds.items()}
    table = disturbed_links(robot.table, GEOMETRY, draws["links"])
    base, tool = draw_base(draws["frames"]).matrix(), draw_tool(draws["frames"]).matrix()
    load = _true_load(robot, tool[:3, 3], draws["masses"])
    campaign = draw_campaign(robot, options.size, draws["campaign"])
    stance = Stance(table, load, campaign.q, campaign.circumstances())
    scene = _scene(stance, campaign, options, draws["effects"])
    chosen = _choose(scene, options)
    if options.kind == "other_forms" and chosen.hidden[0].effect == "settling":
        settle = draws["effects"].uniform(0.8, 1.2, len(campaign.q))
        campaign = replace(campaign, settle_s=settle)
    effects = tuple(
        read_effect({"effect": h.effect, **h.entries}, table.n_joints) for h in chosen.hidden
    )
    cell = HiddenCell(table, base, tool, load, effects)
    return Case(options, robot, cell, campaign, **vars(chosen))


def _true_load(robot: NominalRobot, hand: np.ndarray[Any, Any], draw: np.random.Generator) -> Load:
    """Masses and centres off those in the robot's file."""
    bodies = []
    for carrier, body in enumerate(robot.masses, start=1):
        spread = MASS_SPREAD * float(np.linalg.norm(body.com))
        x, y, z = np.array(body.com) + draw.normal(0.0, spread, 3)
        mass = body.mass_kg * (1.0 + MASS_SPREAD * float(draw.normal()))
        bodies.append((carrier, MassPoint(mass, (float(x), float(y), float(z)))))
    x, y, z = hand + draw.normal(0.0, PAYLOAD_SPREAD, 3)
    down = (0.0, 0.0, -STANDARD_GRAVITY)
    return Load(tuple(bodies), robot.table.n_joints, (float(x), float(y), float(z)), down)


def _scene(
    stance: Stance, campaign: Campaign, options: Options, draw: np.random.Generator
) -> Scene:
    largest = np.abs(stance.loads).max(axis=0)
    up = (stance.loads > 0.0).mean(axis=0)
    able = (up > REVERSING) & (up < 1.0 - REVERSING) & (largest > REVERSING * largest.max())
    return Scene(
        draw=draw,
        table=stance.table,
        loads=largest,
        payload_loads=np.abs(stance.payload_loads).max(axis=0),
        reversing=tuple(int(j) + 1 for j in np.flatnonzero(able)),
        duration_s=float(campaign.time_s[-1]),
        size=options.factor,
        other_form=options.kind == "other_forms",
    )


@dataclass(frozen=True)
class _Chosen:
    hidden: tuple[Hidden, ...] = ()
    covariates: tuple[str, ...] = ()
    kindred: tuple[tuple[str, int | None], ...] = ()
    noise_ppm: float = 0.0


def _choose(scene: Scene, options: Options) -> _Chosen:
    if options.kind in {"clean", "data_fault"}:
        return _Chosen()
    if options.kind == "absent":
        return _choose_unlisted(scene, options.effect)
    possible = [name for name in SIZES if name != SIDES or scene.reversing]
    visible = [name for name in possible if name != INVISIBLE]
    main = options.effect or str(scene.draw.choice(visible))
    first = Hidden(main, SIZES[main](scene))
    if options.kind == "two":
        other = str(scene.draw.choice(_companions(visible, main)))
        return _Chosen((first, Hidden(other, SIZES[other](scene))))
    if options.kind == "background":
        faint = replace(scene, size=scene.size * BACKGROUND)
        rest = (Hidden(name, SIZES[name](faint), main=False) for name in possible if name != main)
        return _Chosen((first, *rest))
    return _Chosen((first,))


def _companions(names: list[str], main: str) -> list[str]:
    """Effects that can be told from the main one with the columns that it allows."""
    clash = WITH_PROBE if main in WITHOUT_PROBE else WITHOUT_PROBE if main in WITH_PROBE else set()
    return [name for name in names if name != main and name not in clash]


def _choose_unlisted(scene: Scene, effect: str | None) -> _Chosen:
    name = effect or str(scene.draw.choice([*CAUSES, RANGE_NOISE]))
    if name == RANGE_NOISE:
        low, high = 10.0, 40.0
        ppm = math.exp(scene.draw.uniform(math.log(low), math.log(high)))
        return _Chosen(noise_ppm=scene.size * ppm)
    cause = CAUSES[name](scene)
    hidden = Hidden(cause.effect, cause.entries)
    return _Chosen((hidden,), cause.covariates, cause.kindred)

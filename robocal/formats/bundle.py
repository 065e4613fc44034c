"""A bundle: one folder with `robot.yaml`, `campaign.yaml` and `measurements.csv`."""

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.errors import BadInput
from robocal.formats.budget_yaml import read_budget
from robocal.formats.fields import Fields, read_fields
from robocal.formats.measurements_csv import held_out_by_column, read_measurements
from robocal.formats.robot_yaml import plain_file_name, read_frame, read_robot
from robocal.formats.unusable_rows import copied_rows, unusable_rows
from robocal.identification.priors import Choices, own_prior
from robocal.identification.station_drift import seen_once
from robocal.instrument import InstrumentNoise
from robocal.measurements import MeasurementSet
from robocal.robots.robot import Robot
from robocal.uncertainty.budget import Budget

_HELD_OUT_FRACTION = 0.25
_HELD_OUT_SEED = 1


@dataclass(frozen=True)
class RejectedRow:
    """A row that takes no part, and why."""

    line: int
    reason: str


@dataclass(frozen=True)
class Target:
    """A nest on the tool (flange frame) or fixed beside the robot; place None where unknown."""

    place: tuple[float, float, float] | None
    fixed: bool


@dataclass(frozen=True)
class Bundle:
    """Everything that one campaign measured. SI units."""

    robot: Robot
    instrument: InstrumentNoise
    measurements: MeasurementSet
    rejected: tuple[RejectedRow, ...]
    base_guess: Float[Array, "6"] | None
    tool_guess: Float[Array, "6"] | None
    targets: dict[str, Target]
    anchor: tuple[float, float, float] | None
    gravity: Float[Array, "3"]
    choices: Choices
    budget: Budget
    sha256: str

    @property
    def tool_known(self) -> bool:
        """Whether rows of the tool itself are there, or the campaign states it."""
        return self.tool_guess is not None or "" in self.measurements.target

    @property
    def tool_rotation_known(self) -> bool:
        """Whether rows to fit show how the tool is turned, or the campaign states it."""
        rows = self.measurements.fit_rows
        # A nest has the flange's axes: its orientation says nothing of the tool's.
        of_tool = np.array([not name for name in rows.target], dtype=bool)
        return self.tool_guess is not None or bool((rows.has_orientation & of_tool).any())

    @property
    def base_rotation_known(self) -> bool:
        """Whether rows to fit show how the base is turned about the anchor, or it is stated."""
        rows = self.measurements.fit_rows
        fixed = {name for name, target in self.targets.items() if target.fixed}
        on_robot = np.array([name not in fixed for name in rows.target], dtype=bool)
        seen = np.isfinite(rows.position[:, 0]) | rows.has_orientation
        return self.base_guess is not None or bool((seen & on_robot).any())


def read_bundle(folder: Path) -> Bundle:
    """A bundle, checked.

    Raises
    ------
    BadInput
        Naming file, line and field of the first thing that is wrong.
    """
    if not folder.is_dir():
        raise BadInput(str(folder), "no such folder; a bundle is a folder with campaign.yaml")
    campaign = read_fields(folder / "campaign.yaml")
    robot_file = plain_file_name(campaign, "robot")
    robot = read_robot(folder / robot_file)
    budget = read_budget(campaign)
    instrument = _instrument(campaign, budget)
    csv_path = folder / "measurements.csv"
    measurements, split = read_measurements(csv_path, robot)
    targets = _targets(campaign)
    lines = measurements.lines
    by_row = copied_rows(measurements) | unusable_rows(measurements)
    reasons = {int(lines[row]): reason for row, reason in by_row.items()}
    fixed = {name for name, target in targets.items() if target.fixed}
    reasons |= seen_once(measurements.rows(~np.isin(lines, list(reasons))), fixed)
    held_out = _held_out(campaign, measurements, split)
    bundle = Bundle(
        robot=robot,
        instrument=instrument,
        measurements=replace(measurements, held_out=held_out).rows(~np.isin(lines, list(reasons))),
        rejected=tuple(RejectedRow(line, reason) for line, reason in sorted(reasons.items())),
        base_guess=_frame(campaign, "base_guess"),
        tool_guess=_frame(campaign, "tool_guess"),
        targets=targets,
        anchor=_anchor(campaign),
        gravity=_gravity(campaign),
        choices=_choices(campaign),
        budget=budget,
        sha256=_hash(folder, ("campaign.yaml", robot_file, "measurements.csv")),
    )
    campaign.finish()
    if not len(bundle.measurements):
        raise BadInput("measurements.csv", "has no usable row")
    return bundle


def _instrument(campaign: Fields, budget: Budget) -> InstrumentNoise:
    """What the instrument states, and what the robot's repeatability and the target add to it."""
    fields = campaign.mapping("instrument")
    fields.text("kind", "laser_tracker")
    fixed = fields.deviation("sigma_mm")
    ppm = fields.number("sigma_ppm", 0.0)
    mrad = fields.deviation("sigma_mrad", 0.05)
    if ppm < 0:
        raise fields.error("sigma_ppm", f"must not be negative, not {ppm:g}")
    fields.finish()
    robot_mm, robot_mrad = 0.0, 0.0
    if "repeatability" in campaign:
        repeatability = campaign.mapping("repeatability")
        robot_mm = repeatability.number("sigma_mm")
        robot_mrad = repeatability.number("sigma_mrad", 0.0)
        if min(robot_mm, robot_mrad) < 0:
            raise repeatability.error("sigma_mm", "and sigma_mrad must not be negative")
        repeatability.finish()
    return InstrumentNoise(
        fixed * 1e-3, ppm * 1e-6, mrad * 1e-3, robot_mm * 1e-3, robot_mrad * 1e-3, budget.target
    )


def _choices(campaign: Fields) -> Choices:
    """Parameters that the campaign fixes, frees, or gives a prior of their own."""
    if "parameters" not in campaign:
        return Choices()
    fields = campaign.mapping("parameters")
    fixed = frozenset(fields.texts("fixed") if "fixed" in fields else ())
    free = frozenset(fields.texts("free") if "free" in fields else ())
    prior_std = {}
    if "prior_std" in fields:
        priors = fields.mapping("prior_std")
        for key in priors.names():
            try:
                name, value = own_prior(key, priors.number(key))
            except ValueError as error:
                raise priors.error(key, str(error)) from None
            prior_std[name] = value
    fields.finish()
    return Choices(fixed, free, prior_std)


def _frame(campaign: Fields, name: str) -> Float[Array, "6"] | None:
    if name not in campaign:
        return None
    fields = campaign.mapping(name)
    frame = read_frame(fields)
    fields.finish()
    return frame


def _targets(campaign: Fields) -> dict[str, Target]:
    if "targets" not in campaign:
        return {}
    fields = campaign.mapping("targets")
    targets = {}
    for name in fields.names():
        target = fields.mapping(name)
        place = None
        if "xyz_mm" in target:
            x, y, z = (value * 1e-3 for value in target.numbers("xyz_mm", 3))
            place = (x, y, z)
        targets[name] = Target(place, target.flag("fixed", default=False))
        target.finish()
    return targets


def _anchor(campaign: Fields) -> tuple[float, float, float] | None:
    """Place of the anchor of distances, a guess in the measuring frame."""
    if "anchor" not in campaign:
        return None
    fields = campaign.mapping("anchor")
    x, y, z = (value * 1e-3 for value in fields.numbers("xyz_mm", 3))
    fields.finish()
    return (x, y, z)


def _gravity(campaign: Fields) -> Float[Array, "3"]:
    direction = np.array(campaign.numbers("gravity", 3) if "gravity" in campaign else (0, 0, -1.0))
    length = np.linalg.norm(direction)
    if length == 0:
        raise campaign.error("gravity", "must not be zero")
    return np.asarray(direction / length)


def _held_out(
    campaign: Fields, measurements: MeasurementSet, split: tuple[str, ...]
) -> Bool[Array, "row"]:
    has_split = any(split)
    fraction, seed = _HELD_OUT_FRACTION, _HELD_OUT_SEED
    if "held_out" in campaign:
        fields = campaign.mapping("held_out")
        if "column" in fields:
            if fields.text("column") != "split":
                raise fields.error("column", "must be split")
            if not has_split:
                raise fields.error("column", "names 'split', which measurements.csv lacks")
        else:
            has_split = False
            fraction = fields.number("fraction")
            seed = fields.whole_number("seed", _HELD_OUT_SEED)
            if not 0 <= fraction < 1:
                raise fields.error("fraction", f"must be in [0, 1), not {fraction:g}")
        fields.finish()
    if has_split:
        return held_out_by_column("measurements.csv", measurements.lines, split)
    return _draw_poses(measurements, fraction, seed)


def _draw_poses(measurements: MeasurementSet, fraction: float, seed: int) -> Bool[Array, "row"]:
    """A random share of the poses, all repeats of one pose together."""
    poses = np.unique(measurements.pose)
    drawn = np.random.default_rng(seed).permutation(poses)[: round(fraction * len(poses))]
    return np.isin(measurements.pose, drawn)


def _hash(folder: Path, files: tuple[str, ...]) -> str:
    digest = hashlib.sha256()
    for file in files:
        content = (folder / file).read_bytes()
        digest.update(f"{file} {len(content)}\n".encode() + content)
    return digest.hexdigest()

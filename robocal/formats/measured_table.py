"""Measured rows of another program's file, on their way into a bundle."""

from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import yaml
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.errors import BadInput
from robocal.formats.measurements_csv import POSITION, QUATERNION, joint_columns
from robocal.formats.robot_yaml import robot_document
from robocal.formats.table import write_table
from robocal.formats.whole_file import write_whole
from robocal.robots.robot import Robot

LENGTH_UNITS = {"mm": 1e-3, "m": 1.0, "inch": 0.0254}
"""[m]"""


@dataclass(frozen=True)
class MeasurementOptions:
    """What the user says of a file of measurements; None where nothing."""

    length_unit: str | None = None
    """Of the points, where the format does not fix it."""
    euler: str | None = None
    """Order of three angles, where the format does not fix it."""
    names: str | None = None
    """SpatialAnalyzer: form of the point names."""
    joints: Path | None = None
    """SpatialAnalyzer: CSV file of the joints, which the points do not carry."""


@dataclass(frozen=True)
class DeclaredNoise:
    """The instrument as `campaign.yaml` declares it; None: the bundle's own default."""

    sigma_mm: float
    sigma_ppm: float | None = None
    sigma_mrad: float | None = None


@dataclass(frozen=True)
class MeasuredTable:
    """Rows as a bundle keeps them.

    Parameters
    ----------
    joints
        Joint readings [rad], [m] for prismatic joints.
    position
        Target in the measuring frame [m], NaN where it was not measured.
    orientation
        Quaternion w, x, y, z, NaN where it was not measured.
    other
        Further columns of `measurements.csv`, as text.
    targets
        Names of the nests on the tool, where there are several.
    notes
        What the user should know of the import.
    """

    joints: Float[Array, "row joint"]
    position: Float[Array, "row 3"]
    orientation: Float[Array, "row 4"]
    other: dict[str, tuple[str, ...]] = field(default_factory=dict)
    targets: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.joints)


def length_unit(options: MeasurementOptions) -> float:
    """Metres in the file's unit of length.

    Raises
    ------
    BadInput
        If it is not given or not known.
    """
    choice = ", ".join(LENGTH_UNITS)
    if options.length_unit is None:
        raise BadInput("option --units", f"is missing: the file does not say; give {choice}")
    if options.length_unit not in LENGTH_UNITS:
        raise BadInput("option --units", f"must be one of {choice}, not '{options.length_unit}'")
    return LENGTH_UNITS[options.length_unit]


def write_bundle(
    folder: Path, robot: Robot, noise: DeclaredNoise, tables: dict[str, MeasuredTable]
) -> None:
    """`robot.yaml`, `campaign.yaml` and `measurements.csv` in an existing folder.

    Parameters
    ----------
    tables
        By split: one table under an empty name, or one under `fit` and one under `check`.

    Raises
    ------
    BadInput
        If a file cannot be written.
    """
    declared = {name: value for name, value in asdict(noise).items() if value is not None}
    campaign: dict[str, object] = {
        "robot": "robot.yaml",
        "instrument": {"kind": "laser_tracker", **declared},
    }
    targets: dict[str, object] = {name: {} for part in tables.values() for name in part.targets}
    if targets:
        campaign["targets"] = targets
    if "check" in tables:
        campaign["held_out"] = {"column": "split"}
    _write_yaml(folder / "robot.yaml", robot_document(robot))
    _write_yaml(folder / "campaign.yaml", campaign)
    write_table(folder / "measurements.csv", _columns(robot, tables))


def write_robot(path: Path, robot: Robot) -> None:
    """Write `robot.yaml`.

    Raises
    ------
    BadInput
        If the file cannot be written.
    """
    _write_yaml(path, robot_document(robot))


def _write_yaml(path: Path, document: dict[str, object]) -> None:
    text = yaml.safe_dump(document, sort_keys=False, default_flow_style=None, width=160)
    write_whole(path, text)


def _columns(robot: Robot, tables: dict[str, MeasuredTable]) -> dict[str, tuple[str, ...]]:
    columns: dict[str, tuple[str, ...]] = {}
    parts = list(tables.values())
    joints = np.concatenate([part.joints for part in parts]) / robot.joint_scale
    for number, name in enumerate(joint_columns(robot)):
        columns[name] = _cells(joints[:, number])
    position = np.concatenate([part.position for part in parts]) * 1e3
    columns |= {name: _cells(position[:, axis]) for axis, name in enumerate(POSITION)}
    orientation = np.concatenate([part.orientation for part in parts])
    if np.isfinite(orientation).any():
        columns |= {name: _cells(orientation[:, k]) for k, name in enumerate(QUATERNION)}
    for name in dict.fromkeys(name for part in parts for name in part.other):
        columns[name] = tuple(
            cell for part in parts for cell in part.other.get(name, ("",) * len(part))
        )
    if "check" in tables:
        columns["split"] = tuple(name for name, part in tables.items() for _ in range(len(part)))
    return columns


def _cells(values: Float[Array, "row"]) -> tuple[str, ...]:
    """Numbers to the last digit; NaN is an empty cell."""
    return tuple("" if np.isnan(value) else repr(value) for value in values.tolist())

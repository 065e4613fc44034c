"""UR's `calibration.conf`: the factory's corrections to the nominal Denavit-Hartenberg table.

Section `[mounting]`: `delta_theta`, `delta_a`, `delta_d`, `delta_alpha`, lists of six [rad, m], are
added to the nominal Rz(theta) Tz(d) Tx(a) Rx(alpha). The axes of joints 2, 3 and 4 are nearly
parallel, which puts their d at tens to hundreds of metres; the links are therefore rebuilt from
the joint axes.
"""

import re
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.errors import BadInput
from robocal.formats.fields import read_text
from robocal.formats.joint_origins import arm_frame, geometry_of, joint_frame
from robocal.formats.model_export import model_difference
from robocal.formats.robot_import import ImportedRobot, RobotOptions
from robocal.kinematics.model import KinematicModel
from robocal.robots.robot import Robot

_ORDER = ("delta_theta", "delta_d", "delta_a", "delta_alpha")
"""In the order of a link's parameters"""
_SECTION = "mounting"
_ENTRY = re.compile(r"\s*(?P<name>\w+)\s*=\s*(?P<value>[^#]*)")
_STATUS = {"0": "notInitialized", "1": "notLinearised", "2": "Linearised"}
_LARGEST_CORRECTION = 0.05
"""Beyond this the deltas belong to another robot type; real ones stay below 10 mm (peers.md) [m]"""


def read_calibration_conf(path: Path, options: RobotOptions) -> ImportedRobot:
    """The factory-calibrated robot.

    Raises
    ------
    BadInput
        If the nominal robot is not given or does not fit, or the file does not; names the line.
    """
    nominal = options.nominal
    if nominal is None:
        reason = "is missing: name the UR type whose table the deltas are added to, e.g. ur10e"
        raise BadInput("option --robot", reason)
    links = nominal.geometry.links
    if len(links) != 6 or nominal.geometry.prismatic.any() or links[:, 4].any():
        raise BadInput("option --robot", f"'{nominal.name}' is no UR arm in its maker's table")
    entries = _entries(path)
    deltas = np.column_stack([_six(path.name, entries, name) for name in _ORDER])
    raw = links.copy()
    raw[:, :4] += deltas
    geometry = _well_conditioned(nominal.geometry, raw)
    change = model_difference(nominal.geometry, geometry, nominal.limits)
    if change.position > _LARGEST_CORRECTION:
        raise BadInput(
            path.name,
            f"moves the flange of a {nominal.name} by {change.position * 1e3:.0f} mm; "
            "it belongs to another robot type",
        )
    robot = Robot(options.name or path.stem, geometry, nominal.limits)
    notes = (
        f"the flange moves by up to {change.position * 1e3:.2f} mm from the nominal "
        f"{nominal.name}; link masses were left out",
        *_status_note(entries),
    )
    return ImportedRobot(robot, notes)


def _well_conditioned(nominal: KinematicModel, raw: Float[Array, "6 5"]) -> KinematicModel:
    T = nominal.mount
    axes = []
    for theta, d, a, alpha, beta in raw.tolist():
        T = T @ joint_frame(theta, 0.0)
        axes.append(T)
        T = T @ joint_frame(0.0, d) @ arm_frame(a, alpha, beta)
    return geometry_of(np.array(axes), T @ nominal.flange, nominal.prismatic)


def _entries(path: Path) -> dict[str, tuple[int, str]]:
    """Line and text of every entry of the section."""
    section, entries = "", {}
    for number, line in enumerate(read_text(path).splitlines(), 1):
        if line.strip().startswith("["):
            section = line.strip().strip("[]")
        found = _ENTRY.match(line)
        if found and section == _SECTION:
            if found["name"] in entries:
                raise BadInput(f"{path.name} line {number}", f"'{found['name']}' is there twice")
            entries[found["name"]] = (number, found["value"].strip())
    if not entries:
        raise BadInput(path.name, f"has no section [{_SECTION}]; is it a calibration.conf?")
    return entries


def _six(file: str, entries: dict[str, tuple[int, str]], name: str) -> Float[Array, "6"]:
    if name not in entries:
        raise BadInput(file, f"'{name}' is missing in section [{_SECTION}]")
    line, text = entries[name]
    words = text.removeprefix("[").removesuffix("]").split(",")
    try:
        values = np.array([float(word) for word in words])
    except ValueError:
        raise BadInput(f"{file} line {line}", f"'{name}' must be six numbers in [ ]") from None
    if values.shape != (6,) or not np.isfinite(values).all():
        raise BadInput(f"{file} line {line}", f"'{name}' must be six numbers in [ ]")
    return values


def _status_note(entries: dict[str, tuple[int, str]]) -> tuple[str, ...]:
    if "calibration_status" not in entries:
        return ()
    status = entries["calibration_status"][1]
    return (f"calibration_status {status} ({_STATUS.get(status, 'unknown')})",)

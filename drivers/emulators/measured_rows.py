"""The measurements of a campaign as a table of text, and the bundle folder that holds it."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from drivers.emulators.campaign_draw import Campaign
from drivers.emulators.rigid import Matrix, quaternion
from drivers.emulators.robot_file import NominalRobot
from drivers.emulators.true_arm import Vector


@dataclass(frozen=True)
class Reading:
    """What the instrument read, row by row."""

    position: Vector
    """[m]"""
    rotation: Matrix | None
    """(row, 3, 3); None where orientation is not read."""


@dataclass(frozen=True)
class Rows:
    """Columns of measurements.csv by name, in file units."""

    columns: dict[str, Vector]
    split: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.split)

    def with_columns(self, **changed: Vector) -> Rows:
        """Return the table with some columns replaced or added."""
        return replace(self, columns={**self.columns, **changed})

    def text(self) -> str:
        """measurements.csv."""
        sheet = io.StringIO()
        writer = csv.writer(sheet, lineterminator="\n")
        writer.writerow([*self.columns, "split"])
        for k, share in enumerate(self.split):
            writer.writerow([*(_cell(values[k]) for values in self.columns.values()), share])
        return sheet.getvalue()


def _cell(value: float) -> str:
    # Ten digits: a thousandth of a micrometre at ten metres.
    return f"{value:.10g}"


def joint_units(robot: NominalRobot) -> tuple[tuple[str, float], ...]:
    """Unit and size in SI of every joint's column."""
    return tuple(
        ("mm", 1e-3) if slides else ("deg", np.pi / 180.0) for slides in robot.table.prismatic
    )


def joint_columns(robot: NominalRobot, q: Vector, prefix: str = "j") -> dict[str, Vector]:
    """Columns of joint values."""
    return {
        f"{prefix}{j}_{unit}": q[:, j - 1] / size
        for j, (unit, size) in enumerate(joint_units(robot), start=1)
    }


def tabulate(
    robot: NominalRobot, campaign: Campaign, reading: Reading, temperature_degc: Vector | None
) -> Rows:
    """Put a campaign's readings into a table; without a probe there is no temperature column."""
    columns: dict[str, Vector] = {"pose": campaign.pose.astype(float)}
    columns["repeat"] = campaign.repeat.astype(float)
    columns |= joint_columns(robot, campaign.q)
    for axis, name in enumerate(("x_mm", "y_mm", "z_mm")):
        columns[name] = reading.position[:, axis] * 1e3
    if reading.rotation is not None:
        turned = np.array([quaternion(R) for R in reading.rotation])
        columns |= dict(zip(("qw", "qx", "qy", "qz"), turned.T, strict=True))
    columns["t_s"] = campaign.time_s
    if temperature_degc is not None:
        columns["temperature_degc"] = temperature_degc
    columns["payload_kg"] = campaign.payload_kg
    for j in range(campaign.q.shape[1]):
        columns[f"approach{j + 1}"] = campaign.approach[:, j]
    columns["speed"] = campaign.speed
    columns["settle_s"] = campaign.settle_s
    return Rows(columns, tuple("check" if c else "fit" for c in campaign.check))


def write_bundle(folder: Path, robot_text: str, campaign_text: str, rows: Rows) -> None:
    """Write robot.yaml, campaign.yaml and measurements.csv."""
    folder.mkdir(parents=True)
    (folder / "robot.yaml").write_text(robot_text)
    (folder / "campaign.yaml").write_text(campaign_text)
    (folder / "measurements.csv").write_text(rows.text())

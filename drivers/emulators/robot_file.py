"""The nominal robot file, parsed by the world itself."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from drivers.emulators.records import WorldError, build
from drivers.emulators.true_arm import LinkTable, MassPoint


@dataclass(frozen=True)
class LinkMass:
    """Mass of one link and its centre in the link's own frame."""

    mass_kg: float
    com_mm: tuple[float, float, float]


@dataclass(frozen=True)
class NominalRobot:
    """What robot.yaml says."""

    table: LinkTable
    limits: tuple[tuple[float, float], ...]
    """[rad], [m] for a prismatic joint."""
    masses: tuple[MassPoint, ...]
    """One a link; empty when the file has none."""


def read_robot(path: Path) -> NominalRobot:
    """Read robot.yaml; only the convention `mdh` is understood here."""
    document = yaml.safe_load(path.read_text())
    if document["convention"] != "mdh":
        raise WorldError("config", f"{path.name}: convention must be mdh in the emulated world.")
    rows = document["joints"]
    prismatic = tuple(row["type"] == "prismatic" for row in rows)

    def column(name: str, unit: float) -> np.ndarray[Any, np.dtype[np.float64]]:
        return np.array([float(row.get(name, 0.0)) for row in rows]) * unit

    table = LinkTable(
        theta=column("theta_deg", math.pi / 180),
        d=column("d_mm", 1e-3),
        a=column("a_mm", 1e-3),
        alpha=column("alpha_deg", math.pi / 180),
        beta=column("beta_deg", math.pi / 180),
        prismatic=prismatic,
    )
    limits = tuple(_limits(row) for row in rows)
    return NominalRobot(table, limits, read_masses(document.get("links", ())))


def _limits(row: Mapping[str, Any]) -> tuple[float, float]:
    name, unit = (
        ("limits_mm", 1e-3) if row["type"] == "prismatic" else ("limits_deg", math.pi / 180)
    )
    low, high = row.get(name, (-math.inf, math.inf))
    return low * unit, high * unit


def read_masses(rows: Any) -> tuple[MassPoint, ...]:  # noqa: ANN401 - straight from JSON or YAML
    """Masses of the links, in the order of the links."""
    masses = (build(LinkMass, row, "links") for row in rows)
    return tuple(
        MassPoint(m.mass_kg, (m.com_mm[0] * 1e-3, m.com_mm[1] * 1e-3, m.com_mm[2] * 1e-3))
        for m in masses
    )

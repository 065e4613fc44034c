"""What the seed decides: the true links, and where base and target are."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from drivers.emulators.rigid import Frame
from drivers.emulators.true_arm import LinkTable
from drivers.emulators.world_config import GeometryError

PARALLEL_AXES = 1e-6
"""Below this |sin(alpha)| a joint's axis counts as parallel to the next one."""


def disturbed_links(table: LinkTable, error: GeometryError, draw: np.random.Generator) -> LinkTable:
    """Draw the true links about the nominal ones.

    `beta` is disturbed only behind parallel axes, where it stands for what `d` cannot say.
    """
    n = table.n_joints
    length, angle = error.length_mm * 1e-3, error.angle_mrad * 1e-3
    parallel = np.abs(np.sin(table.alpha)) < PARALLEL_AXES
    return replace(
        table,
        theta=table.theta + draw.normal(0.0, angle, n),
        d=table.d + draw.normal(0.0, length, n),
        a=table.a + draw.normal(0.0, length, n),
        alpha=table.alpha + draw.normal(0.0, angle, n),
        beta=table.beta + draw.normal(0.0, angle, n) * parallel,
    )


def draw_base(draw: np.random.Generator) -> Frame:
    """Draw a base 1.5 to 3 m from a roughly level tracker, facing anywhere."""
    distance, azimuth = draw.uniform(1500.0, 3000.0), draw.uniform(-math.pi, math.pi)
    height = draw.uniform(-1000.0, 0.0)
    yaw, (pitch, roll) = draw.uniform(-180.0, 180.0), draw.normal(0.0, 1.0, 2)
    return Frame(
        (distance * math.cos(azimuth), distance * math.sin(azimuth), height),
        (yaw, float(pitch), float(roll)),
    )


def draw_tool(draw: np.random.Generator) -> Frame:
    """Draw a target off the last axis, so that every joint moves it."""
    offset, azimuth = draw.uniform(40.0, 100.0), draw.uniform(-math.pi, math.pi)
    height = draw.uniform(60.0, 160.0)
    yaw, pitch, roll = draw.uniform(-30.0, 30.0, 3)
    return Frame(
        (offset * math.cos(azimuth), offset * math.sin(azimuth), height),
        (float(yaw), float(pitch), float(roll)),
    )

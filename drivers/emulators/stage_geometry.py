"""The true sensing stage: where its cups are, and what its three sensors then say.

Frame of the stage: the guide along x, the rod's axis along z. At slide s the rod leaves the slide
cup at `angle` from -x towards +y. What a sensor or the guide gets wrong is the stage's fault,
hidden from everything that reads it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drivers.emulators.rigid import Frame, Matrix, translation, turn_y, turn_z

SENSORS = ("slide", "rod_angle", "rod_length")
CUPS = ("slide", "rod")


@dataclass(frozen=True)
class StageFaults:
    """By how much the truth differs from what the sensors and a straight square guide would say."""

    angle_zero_mrad: float = 0.0
    rod_zero_mm: float = 0.0
    rod_scale_ppm: float = 0.0
    slide_scale_ppm: float = 0.0
    squareness_mrad: float = 0.0
    abbe_pitch_mrad_per_m: float = 0.0
    abbe_yaw_mrad_per_m: float = 0.0
    sag_mm_at_m: float = 0.0
    """Sag of a rod of one metre; grows with the fourth power of the length."""


@dataclass(frozen=True)
class SensorNoise:
    """Standard deviations: of a sensor's error wherever the part is set down, and of one reading.

    The first stays while the part is clamped, the second shows as spread.
    """

    setting_mm: float = 0.03
    setting_mrad: float = 0.08
    reading_mm: float = 0.005
    reading_mrad: float = 0.02


@dataclass(frozen=True)
class StageConfig:
    """Everything that a stage world's configuration may say."""

    master: str
    """The master's world, host:port."""
    slave: str
    stage: Frame
    """The stage in the master's base."""
    slave_base: Frame
    """The slave's base in the master's base."""
    seat_mm: float = 0.03
    """Standard deviation of the needle's place in a cup, per axis."""
    seed: int = 1
    faults: StageFaults = field(default_factory=StageFaults)
    noise: SensorNoise = field(default_factory=SensorNoise)


def slide_frame(faults: StageFaults, slide: float) -> Matrix:
    """Pose of the slide with the rod's axis in the stage frame at a true slide position [m]."""
    yaw = faults.abbe_yaw_mrad_per_m * 1e-3 * slide
    pitch = (faults.squareness_mrad + faults.abbe_pitch_mrad_per_m * slide) * 1e-3
    return np.asarray(translation(slide, 0.0, 0.0) @ turn_z(yaw) @ turn_y(pitch))


def cup_place(
    faults: StageFaults, stage: Matrix, cup: str, slide: float, angle: float, length: float
) -> Matrix:
    """Where a cup is in the master's base [m], at the stage's true positions."""
    T = stage @ slide_frame(faults, slide)
    if cup == "slide":
        return np.asarray(T[:3, 3])
    rod = T @ turn_z(-angle) @ translation(-length, 0.0, 0.0)
    along = (rod[:3, 3] - T[:3, 3]) / length
    down = np.array([0.0, 0.0, -1.0])
    sag = faults.sag_mm_at_m * 1e-3 * length**4
    return np.asarray(rod[:3, 3] + sag * (down - along * (along @ down)))


def shown(faults: StageFaults, slide: float, angle: float, length: float) -> dict[str, float]:
    """What faultily adjusted but noiseless sensors say at the stage's true positions."""
    return {
        "slide": slide / (1.0 + faults.slide_scale_ppm * 1e-6),
        "rod_angle": angle - faults.angle_zero_mrad * 1e-3,
        "rod_length": (length - faults.rod_zero_mm * 1e-3) / (1.0 + faults.rod_scale_ppm * 1e-6),
    }

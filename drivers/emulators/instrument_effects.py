"""Hidden effects of the instrument: it sees the target where it is not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivers.emulators.effect import Effect
from drivers.emulators.rigid import Matrix
from drivers.emulators.true_arm import Vector


@dataclass(frozen=True)
class InstrumentScale(Effect):
    """Ranges are off by a factor: air of another temperature or pressure than set."""

    scale_ppm: float

    def seen(self, T_tracker_target: Matrix) -> Vector:
        """Return the shift along the beam."""
        return np.asarray(self.scale_ppm * 1e-6 * T_tracker_target[..., :3, 3])


@dataclass(frozen=True)
class InstrumentAngle(Effect):
    """Circles err twice a turn: azimuth and elevation by amplitude x sin(2 angle + phase)."""

    azimuth_urad: float
    azimuth_phase_deg: float
    elevation_urad: float
    elevation_phase_deg: float
    third_share: float = 0.0
    """Amplitude of three waves a turn over that of two."""

    def seen(self, T_tracker_target: Matrix) -> Vector:
        """Return where the wrong angles put the target, less where it is."""
        p = T_tracker_target[..., :3, 3]
        level = np.hypot(p[..., 0], p[..., 1])
        azimuth, elevation = np.arctan2(p[..., 1], p[..., 0]), np.arctan2(p[..., 2], level)
        read_azimuth = azimuth + self._error(azimuth, self.azimuth_urad, self.azimuth_phase_deg)
        read_elevation = elevation + self._error(
            elevation, self.elevation_urad, self.elevation_phase_deg
        )
        distance = np.linalg.norm(p, axis=-1)
        across = distance * np.cos(read_elevation)
        read = (
            across * np.cos(read_azimuth),
            across * np.sin(read_azimuth),
            distance * np.sin(read_elevation),
        )
        return np.asarray(np.stack(read, axis=-1) - p)

    def _error(self, angle: Vector, amplitude_urad: float, phase_deg: float) -> Vector:
        phase = np.radians(phase_deg)
        wave = np.sin(2.0 * angle + phase) + self.third_share * np.sin(3.0 * angle - phase)
        return np.asarray(amplitude_urad * 1e-6 * wave)

"""What a campaign states of sources of uncertainty besides the instrument's own noise."""

from dataclasses import dataclass
from enum import StrEnum


class ReadingsBy(StrEnum):
    """How the scatter of the readings is evaluated (GUM, 2.3.2 and 2.3.3)."""

    declared = "declared"
    """Type B: what the campaign states of instrument and robot."""
    repeats = "repeats"
    """Type A: the scatter of the repeats, in place of what is stated."""


@dataclass(frozen=True)
class Budget:
    """The optional part of a campaign's statement; zero where nothing is stated.

    Parameters
    ----------
    target
        Centre of the reflector in its nest, per axis; new at every pose, the same for the repeats
        of one pose [m].
    scale
        Length scale of the instrument, the same for all readings: wavelength, air [m/m].
    temperature
        How far the robot's temperature in use may be off that of the campaign [degC].
    expansion
        Thermal expansion of the robot's structure [1/degC].
    readings
        Whether repeats stand in for the declared scatter.
    """

    target: float = 0.0
    scale: float = 0.0
    temperature: float = 0.0
    expansion: float = 0.0
    readings: ReadingsBy = ReadingsBy.declared

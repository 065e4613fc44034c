"""What the stage's sensors may get wrong, each as one parameter with a physical prior."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array


@dataclass(frozen=True)
class Correction:
    """One sensor correction.

    Parameters
    ----------
    name
        Parameter name; in files it ends in `unit`.
    unit, scale
        File unit, and its size in SI.
    prior_std
        How far a sound stage may be off, one standard deviation [SI].
    fault_std
        How far a faulty one is off [SI]; at least twice the prior, else it could not be told apart.
    meaning
        What it is, for a report.
    revealed_by
        The touches that tell it from everything else.
    """

    name: str
    unit: str
    scale: float
    prior_std: float
    fault_std: float
    meaning: str
    revealed_by: str

    @property
    def field(self) -> str:
        """Name in files, `angle_zero_mrad`."""
        return f"{self.name}_{self.unit}"


CORRECTIONS: tuple[Correction, ...] = (
    Correction(
        "angle_zero",
        "mrad",
        1e-3,
        0.2e-3,
        2e-3,
        "rod angle zero (a guide out of square within the rod's plane acts alike)",
        "touches of one robot at slide positions far apart, or the stage turned upside down; "
        "turned end for end on its feet it stays hidden",
    ),
    Correction(
        "rod_zero",
        "mm",
        1e-3,
        0.02e-3,
        0.2e-3,
        "rod length zero",
        "rod cup touches in several directions, and the slide cup at the same slide position",
    ),
    Correction(
        "rod_scale",
        "ppm",
        1e-6,
        20e-6,
        400e-6,
        "rod length scale",
        "rod lengths that differ at least twofold",
    ),
    Correction(
        "slide_scale",
        "ppm",
        1e-6,
        50e-6,
        500e-6,
        "slide scale (the beam's cosine error acts alike)",
        "touches of one robot at slide positions far apart",
    ),
    Correction(
        "squareness",
        "mrad",
        1e-3,
        0.1e-3,
        1e-3,
        "rod axis out of square to the guide, out of the rod's plane",
        "the stage turned end for end, or touches of one robot at slide positions far apart",
    ),
    Correction(
        "abbe_pitch",
        "mrad_per_m",
        1e-3,
        0.02e-3,
        0.4e-3,
        "pitch of the slide along its travel, at the rod's arm (Abbe)",
        "rod cup touches at slide positions far apart, by one robot",
    ),
    Correction(
        "abbe_yaw",
        "mrad_per_m",
        1e-3,
        0.02e-3,
        0.4e-3,
        "yaw of the slide along its travel, at the rod's arm (Abbe)",
        "rod cup touches at slide positions far apart, by one robot",
    ),
    Correction(
        "sag",
        "mm",
        1e-3,
        0.02e-3,
        0.2e-3,
        "sag of the rod's end at the longest rod touched",
        "rod lengths that differ at least twofold",
    ),
)
ANGLE_ZERO, ROD_ZERO, ROD_SCALE, SLIDE_SCALE, SQUARENESS, ABBE_PITCH, ABBE_YAW, SAG = range(8)
N_CORRECTIONS = len(CORRECTIONS)


def default_prior_std() -> Float[Array, "correction"]:
    """Prior standard deviations of a sound stage [SI]."""
    return np.array([correction.prior_std for correction in CORRECTIONS])

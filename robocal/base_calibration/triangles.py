"""Plane triangles by the law of cosines."""

import numpy as np


def side(first: float, second: float, angle: float) -> float:
    """The side opposite `angle` [rad] between two sides."""
    return float(np.sqrt(first**2 + second**2 - 2.0 * first * second * np.cos(angle)))


def corner(first: float, second: float, opposite: float) -> float:
    """The angle between `first` and `second` [rad]; a triangle that noise opened is flat."""
    cosine = (first**2 + second**2 - opposite**2) / (2.0 * first * second)
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))


def wrapped(angle: float) -> float:
    """The angle within (-pi, pi] [rad]."""
    return float(np.pi - (np.pi - angle) % (2.0 * np.pi))

"""Numerics of robot-cell calibration: arrays in, frozen dataclasses out, SI units."""

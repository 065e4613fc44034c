"""Identification of the robot's real geometry from measured poses."""

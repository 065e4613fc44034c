"""Kinematics of a serial arm in modified Denavit-Hartenberg (MDH) form."""

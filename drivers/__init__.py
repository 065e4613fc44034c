"""Bytes to numbers: robots, trackers and sensors, and the emulators that stand in for them."""

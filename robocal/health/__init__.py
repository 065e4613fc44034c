"""Whether a calibrated robot is still as it was, and what moved if not."""

"""Choice of the poses to measure."""

"""Published experiments, run again and set beside what was printed."""

"""Nominal robots as data files, each with the source of its table."""

"""Slips of convention, unit and row order in the data, found before any fit."""

"""A second world that hides effects, written from the notes on effects and the file formats alone.

Its author had seen neither the catalogue nor the first emulated world, and nothing of either is
used here: what a sign, an axis or the place of a load is taken for could be wrong in both of those
alike, but hardly here too. `python -m tests.blind --world second` counts what is said of it.
"""

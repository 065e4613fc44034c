"""A bundle that may be fitted: no slip of unit, sign, convention or row order is left in it."""

from pathlib import Path

from robocal.data_faults.search import find_slips
from robocal.data_faults.slip import Slip
from robocal.errors import BadInput
from robocal.formats.bundle import Bundle, read_bundle
from robocal.identification.prepared import prepare

_MOST_SENTENCES = 6


def read_sound(folder: Path) -> Bundle:
    """Read a bundle and make sure that it is one.

    Raises
    ------
    BadInput
        If it cannot be read, has too few different poses, or naming its slips with their mends.
    NoAnswer
        If its readings are not of this robot.
    """
    bundle = read_bundle(folder)
    prepare(bundle, bundle.choices)
    refuse_slips(bundle)
    return bundle


def refuse_slips(bundle: Bundle) -> None:
    """Make sure that no slip is left.

    Raises
    ------
    BadInput
        Naming the slips with their mends.
    NoAnswer
        If the readings are not of this robot.
    """
    slips = find_slips(bundle)
    if slips:
        raise BadInput("measurements.csv", said(slips))


def said(slips: tuple[Slip, ...]) -> str:
    """What is wrong and how to mend it; of very many slips the first ones."""
    sentences = [slip.report() for slip in slips[:_MOST_SENTENCES]]
    more = len(slips) - len(sentences)
    return "; and ".join((*sentences, *((f"{more} more slips",) if more else ())))

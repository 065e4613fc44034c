"""A slip of the data: what is wrong, where, and the exact mend."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum

from robocal.errors import NoAnswer
from robocal.formats.bundle import Bundle, RejectedRow
from robocal.measurements import MeasurementSet


class Fault(StrEnum):
    """The contract's names."""

    unit = "unit"
    angle_convention = "angle_convention"
    quaternion_order = "quaternion_order"
    joint_sign = "joint_sign"
    mirrored_frame = "mirrored_frame"
    row_shift = "row_shift"
    swapped_rows = "swapped_rows"
    wrong_joint_source = "wrong_joint_source"


Mend = Callable[[MeasurementSet], MeasurementSet]
"""Turns rows into what they should have been; rows that lose their partner are left out."""


@dataclass(frozen=True)
class Slip:
    """One slip.

    Parameters
    ----------
    fault
        Its name.
    columns
        Columns of measurements.csv that it spoils.
    sentence
        What is wrong and the exact mend.
    mend
        The mend itself.
    lines
        Lines of measurements.csv that it spoils; empty where it spoils every row.
    rivals
        Other mends that these data cannot tell from this one, a sentence each.
    """

    fault: Fault
    columns: tuple[str, ...]
    sentence: str
    mend: Mend
    lines: tuple[int, ...] = ()
    rivals: tuple[str, ...] = ()

    def report(self) -> str:
        """The sentence, with its rivals."""
        return "; or, which these data cannot tell apart: ".join((self.sentence, *self.rivals))


def mend(bundle: Bundle, slips: tuple[Slip, ...]) -> Bundle:
    """The bundle as it should have been; its hash stays that of the files.

    Raises
    ------
    NoAnswer
        If the data cannot tell which of several mends is the right one.
    """
    rows = bundle.measurements
    for slip in slips:
        if slip.rivals:
            raise NoAnswer(f"measurements.csv: {slip.report()}. Mend the file by hand")
        rows = slip.mend(rows)
    kept = set(rows.lines.tolist())
    lost = tuple(
        RejectedRow(int(line), "no joints belong to it once the row shift is mended")
        for line in bundle.measurements.lines
        if line not in kept
    )
    return replace(bundle, measurements=rows, rejected=(*bundle.rejected, *lost))


def mend_whichever(bundle: Bundle, slips: tuple[Slip, ...]) -> Bundle:
    """The same where rivals do not matter: they fit equally well, and the first is taken."""
    return mend(bundle, tuple(replace(slip, rivals=()) for slip in slips))

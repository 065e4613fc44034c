"""A bundle as a command is told to take it: slips mended or refused, parameters as chosen."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from robocal.errors import BadInput

if TYPE_CHECKING:
    from robocal.data_faults.slip import Slip
    from robocal.formats.bundle import Bundle
    from robocal.identification.priors import Choices

DEFAULT_STRATEGY = "simultaneous"
Strategy = Annotated[str, typer.Option(help="cross or simultaneous")]
Fix = Annotated[list[str] | None, typer.Option(help="keep a parameter nominal: d_4")]
Free = Annotated[list[str] | None, typer.Option(help="identify it without prior: a_2")]
Prior = Annotated[list[str] | None, typer.Option(help="its own standard deviation: a_2_mm=0.2")]
Mend = Annotated[
    bool, typer.Option("--mend", help="mend slips of unit, sign or row order, and say so")
]


@dataclass(frozen=True)
class ChosenBundle:
    """What is to be fitted, and what was mended on the way."""

    bundle: "Bundle"
    slips: tuple["Slip", ...]

    @property
    def mended(self) -> list[dict[str, object]]:
        """The mends as result files keep them."""
        return [
            {
                "fault": slip.fault.value,
                "columns": list(slip.columns),
                "lines": list(slip.lines),
                "mend": slip.sentence,
            }
            for slip in self.slips
        ]

    @property
    def sentences(self) -> list[str]:
        """The mends for people."""
        return [f"mended: {slip.sentence}" for slip in self.slips]


def read_chosen(folder: Path, asked: "Choices", *, wanted_mended: bool) -> ChosenBundle:
    """Read a bundle, mend its slips if that is wanted, and apply the choices over its own.

    Raises
    ------
    BadInput
        If it cannot be read, or has slips and nobody asked to mend them.
    NoAnswer
        If its readings are not of this robot.
    """
    from robocal.data_faults.search import find_slips
    from robocal.data_faults.slip import mend
    from robocal.formats.bundle import read_bundle
    from service.sound_bundle import said

    bundle = read_bundle(folder)
    slips = find_slips(bundle)
    if slips and not wanted_mended:
        raise BadInput("measurements.csv", f"{said(slips)} (--mend does it)")
    sound = mend(bundle, slips)
    return ChosenBundle(replace(sound, choices=sound.choices.overruled_by(asked)), slips)

"""Arguments and options that several commands share, and the files that they write."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from robocal.errors import BadInput

if TYPE_CHECKING:
    from robocal.calibrated import CalibratedRobot

BundleFolder = Annotated[Path, typer.Argument(help="folder with campaign.yaml", metavar="BUNDLE")]
OutFolder = Annotated[Path, typer.Option("--out", help="folder for the results, made if missing")]
OutFile = Annotated[Path, typer.Option("--out", help="CSV file to write")]
AsJson = Annotated[bool, typer.Option("--json", help="print the result's JSON and nothing else")]


def robot_names() -> list[str]:
    """The robots of the library, for a shell that completes one."""
    from robocal.robots.library import ROBOTS

    return list(ROBOTS)


def warn(sentence: str) -> None:
    """Tell a person on standard error, which no program takes for the result."""
    sys.stderr.write(f"robocal: {' '.join(sentence.split())}\n")


def warn_if_inadequate(calibrated: "CalibratedRobot", path: Path) -> None:
    """Tell a person that a model was found not to explain its own readings."""
    stated = calibrated.provenance.adequacy
    if stated is not None and not stated.adequate:
        warn(f"{path}: {stated.warning}")


def make_folder(folder: Path) -> None:
    """Make a folder for results.

    Raises
    ------
    BadInput
        If the system does not allow it.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(str(folder), f"cannot be made: {error.strerror}") from None


def write_json(path: Path, document: dict[str, object]) -> None:
    """Write a document, whole or not at all."""
    from robocal.formats.whole_file import write_whole

    write_whole(path, json_text(document))


def json_text(document: dict[str, object]) -> str:
    """A document as it stands in a file."""
    return json.dumps(document, indent=2, allow_nan=False) + "\n"

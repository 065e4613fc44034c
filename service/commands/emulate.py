"""`robocal emulate`."""

from typing import Annotated

import typer


def emulate(
    robot: Annotated[str, typer.Option(help="a known robot")] = "ur10e",
    time_scale: Annotated[float, typer.Option(min=1.0, max=1000.0)] = 1.0,
) -> None:
    """Start an emulated cell (robot controller, tracker) for a person to try."""
    from service.emulated_cell import emulate as run

    run(robot, time_scale)

"""`robocal demo`."""

from typing import Annotated

import typer


def demo(
    poses: Annotated[int, typer.Option(min=10, max=500, help="poses to calibrate with")] = 40,
    targets: Annotated[int, typer.Option(min=1, max=500, help="other poses to verify at")] = 30,
    *,
    once: Annotated[bool, typer.Option(envvar="ONCE", help="stop when done")] = False,
) -> None:
    """Run the whole chain against emulated hardware: campaign, identification, verification."""
    from service.demo import run_demo

    run_demo(poses, targets, once=once)

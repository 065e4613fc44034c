"""`robocal demo`."""

from typing import Annotated

import typer


def demo(
    *,
    once: Annotated[bool, typer.Option(envvar="ONCE", help="stop when done")] = False,
) -> None:
    """Run the whole chain against emulated hardware: campaign, identification, verification."""
    from service.demo import run_demo

    run_demo(once=once)

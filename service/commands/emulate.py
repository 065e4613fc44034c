"""`robocal emulate`."""

from typing import Annotated

import typer


def emulate(
    robot: Annotated[str, typer.Option(help="a robot of the library")] = "ur10e",
    time_scale: Annotated[float, typer.Option(min=1.0, max=1000.0)] = 1.0,
    seed: Annotated[int, typer.Option(min=0)] = 1,
) -> None:
    """Start an emulated cell (robot controller, tracker) for a person to try."""
    import time

    from service.emulated_cell import EmulatedCell

    with EmulatedCell(robot, time_scale, seed) as cell:
        if cell.note:
            print(cell.note)
        print(f"robot:   driver {cell.robot_driver}, address {cell.robot_address}")
        print(f"tracker: driver {cell.tracker_driver}, address {cell.tracker_address}")
        print("Ctrl+C ends it", flush=True)
        try:
            while True:
                time.sleep(3600)
        except KeyboardInterrupt:
            print()

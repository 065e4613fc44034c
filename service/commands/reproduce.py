"""`robocal reproduce`."""

from pathlib import Path
from typing import Annotated

import typer


def reproduce(
    seed: Annotated[int, typer.Option(min=0)] = 1,
    draws: Annotated[int, typer.Option(min=10, help="noise draws of document 001")] = 1000,
    pictures: Annotated[Path | None, typer.Option(help="folder for the plots")] = None,
) -> None:
    """Run the published experiments again, our figures beside the printed ones (Markdown)."""
    from robocal.formats.whole_file import write_together
    from service.commands.options import make_folder
    from service.progress_bar import progress_bar
    from service.reproduce import base_calibration, optimal_poses
    from service.reproduce.optimal_poses_study import Sizes

    with progress_bar():
        compared = base_calibration.compare(draws, seed)
    print("## Document 001: base calibration\n")
    print(base_calibration.report(compared))
    with progress_bar():
        found = optimal_poses.reproduce(seed, Sizes())
    print("## Document 002: optimal poses and uncertainty\n")
    print(optimal_poses.report(found))
    if pictures is not None:
        make_folder(pictures)
        write_together({
            pictures / name: text for name, text in optimal_poses.pictures(found).items()
        })

"""`robocal emulate`."""

from __future__ import annotations

import json
import sys
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.commands.options import robot_names

if TYPE_CHECKING:
    from service.emulated_cell import CellAddresses
    from service.emulated_stage import StageAddresses, StageHands

_TOUCH_WORDS = 5


def emulate(
    robot: Annotated[
        str, typer.Option(help="a robot of the library", autocompletion=robot_names)
    ] = "ur10e",
    time_scale: Annotated[float, typer.Option(min=1.0, max=1000.0)] = 1.0,
    seed: Annotated[int, typer.Option(min=0)] = 1,
    hide: Annotated[
        list[str] | None,
        typer.Option(
            help='an effect for diagnosis to find: {"effect": "backlash", "joint": 3, ...}'
        ),
    ] = None,
    cell: Annotated[
        Path | None,
        typer.Option(help="write the cell as POST /cells takes it, named as the file is"),
    ] = None,
    *,
    stage: Annotated[
        bool, typer.Option("--stage", help="two robots and a sensing stage between them")
    ] = False,
) -> None:
    """Start an emulated cell (robot controller, tracker) or stage for a person to try."""
    if stage:
        _emulate_stage(seed)
    else:
        _emulate_cell(robot, time_scale, seed, _effects(hide or []), cell)


def _emulate_cell(
    robot: str, time_scale: float, seed: int, hidden: list[dict[str, object]], file: Path | None
) -> None:
    import time

    from robocal.formats.whole_file import write_whole
    from service.emulated_cell import NEST, NEST_MM, EmulatedCell

    with EmulatedCell(robot, time_scale, seed, hidden) as addresses:
        if addresses.note:
            print(addresses.note)
        print(f"robot:   driver {addresses.robot_driver}, address {addresses.robot_address}")
        print(f"tracker: driver {addresses.tracker_driver}, address {addresses.tracker_address}")
        print(f"probe:   driver mock, address {addresses.world_address}")
        print(f"nest:    {NEST} at {', '.join(f'{mm:g}' for mm in NEST_MM)} mm")
        if file is not None:
            write_whole(file, json.dumps(_settings(file.stem, robot, addresses), indent=2) + "\n")
            print(f"cell:    {file}")
        print("Ctrl+C ends it", flush=True)
        try:
            while True:
                time.sleep(3600)
        except KeyboardInterrupt:
            print()


def _settings(name: str, robot: str, addresses: CellAddresses) -> dict[str, object]:
    """The body of POST /cells."""
    return {
        "name": name,
        "robot": {
            "model": robot,
            "driver": addresses.robot_driver,
            "address": addresses.robot_address,
        },
        "tracker": {"driver": addresses.tracker_driver, "address": addresses.tracker_address},
        "temperature_probe": {"driver": "mock", "address": addresses.world_address},
    }


def _effects(hidden: list[str]) -> list[dict[str, object]]:
    """The effects that were asked for.

    Raises
    ------
    BadInput
        If one of them is not a JSON object.
    """
    from robocal.errors import BadInput

    effects: list[dict[str, object]] = []
    for text in hidden:
        try:
            effect = json.loads(text)
        except ValueError:
            effect = None
        if not isinstance(effect, dict):
            raise BadInput("option --hide", f'wants a JSON object with "effect", not {text}')
        effects.append(effect)
    return effects


def _emulate_stage(seed: int) -> None:
    from service.emulated_stage import EmulatedStage, StageHands

    with EmulatedStage(seed) as addresses, closing(StageHands(addresses.stage_world)) as hands:
        _introduce(addresses)
        try:
            for line in sys.stdin:
                _touch(hands, line.split())
        except KeyboardInterrupt:
            print()


def _introduce(addresses: StageAddresses) -> None:
    """Say what to type into the page's form, or to send to POST /base-calibrations."""
    if addresses.note:
        print(addresses.note)
    print("body of POST /api/v1/base-calibrations, and what to type on the page:")
    print(json.dumps(addresses.request("emulated"), indent=1))
    print("lead a needle into a cup: ROBOT CUP SLIDE_MM ANGLE_DEG LENGTH_MM")
    print("for instance: master rod 0 0 350")
    print("end of input or Ctrl+C ends it", flush=True)


def _touch(hands: StageHands, words: list[str]) -> None:
    if len(words) != _TOUCH_WORDS:
        print("five words are needed: master rod 0 0 350", flush=True)
        return
    robot, cup, slide, angle, length = words
    reply = hands.touch(robot, cup, slide_mm=slide, rod_angle_deg=angle, rod_length_mm=length)
    print(f"the {robot}'s needle sits in the {cup} cup" if reply["ok"] else reply["message"])
    sys.stdout.flush()

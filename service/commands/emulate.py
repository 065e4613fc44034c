"""`robocal emulate`."""

from __future__ import annotations

import json
import signal
import time
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.commands.options import robot_names

if TYPE_CHECKING:
    from service.emulated_cell import CellAddresses, Wires
    from service.emulated_stage import StageAddresses


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
    robot_driver: Annotated[
        str, typer.Option(help="ur_rtde, modbus or mock; by the robot if not given")
    ] = "",
    tracker: Annotated[str, typer.Option(help="geocom, ndi, relay or mock")] = "",
    probe: Annotated[str, typer.Option(help="modbus_temperature or mock")] = "",
    fault: Annotated[
        list[str] | None,
        typer.Option(help="of a wire from the start: tracker:silence, robot:local_control"),
    ] = None,
    *,
    stage: Annotated[
        bool, typer.Option("--stage", help="two robots and a sensing stage between them")
    ] = False,
) -> None:
    """Start an emulated cell (robot controller, tracker, probe) or stage for a person to try.

    Faults and effects are also switched by lines that are typed while it runs: help lists them.
    """
    # Ended from outside, it ends what it started too.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        if stage:
            _emulate_stage(seed, fault or [])
            return
        wires = _wires(robot_driver, tracker, probe)
        _emulate_cell(robot, time_scale, seed, _effects(hide or []), wires, fault or [], cell)
    except KeyboardInterrupt:
        print()


def _wires(robot: str, tracker: str, probe: str) -> Wires:
    """The drivers that were asked for.

    Raises
    ------
    BadInput
        If one of them is not among those that can be emulated.
    """
    from robocal.errors import BadInput
    from service.emulated_cell import PROBES, ROBOTS, TRACKERS, Wires

    for option, driver, known in (
        ("--robot-driver", robot, ROBOTS),
        ("--tracker", tracker, TRACKERS),
        ("--probe", probe, PROBES),
    ):
        if driver and driver not in known:
            raise BadInput(f"option {option}", f"{driver!r} is none of {', '.join(known)}")
    return Wires(robot, tracker, probe)


def _emulate_cell(
    robot: str,
    time_scale: float,
    seed: int,
    hidden: list[dict[str, object]],
    wires: Wires,
    faults: list[str],
    file: Path | None,
) -> None:
    from robocal.formats.whole_file import write_whole
    from service.emulated_cell import EmulatedCell
    from service.emulated_hands import CellHands, converse
    from service.world_client import WorldClient

    with (
        EmulatedCell(robot, time_scale, seed, hidden, wires) as addresses,
        closing(WorldClient(addresses.world)) as world,
    ):
        hands = CellHands(addresses.wires, world)
        _introduce_cell(addresses)
        for text in faults:
            print(hands.follow(text.replace(":", " ", 1)))
        if file is not None:
            write_whole(file, json.dumps(_settings(file.stem, robot, addresses), indent=2) + "\n")
            print(f"cell:    {file}")
        print("help lists the faults that can be typed here; Ctrl+C ends it", flush=True)
        converse(hands)
        while True:
            time.sleep(3600)


def _introduce_cell(addresses: CellAddresses) -> None:
    from service.emulated_cell import NEST, NEST_MM

    if addresses.note:
        print(addresses.note)
    for part, wire in addresses.wires.items():
        print(f"{part + ':':8} driver {wire.driver}, address {wire.address}")
    print(f"nest:    {NEST} at {', '.join(f'{mm:g}' for mm in NEST_MM)} mm")


def _settings(name: str, robot: str, addresses: CellAddresses) -> dict[str, object]:
    """The body of POST /cells."""
    places = {
        part: {"driver": wire.driver, "address": wire.address}
        for part, wire in addresses.wires.items()
    }
    return {
        "name": name,
        "robot": {"model": robot, **places["robot"]},
        "tracker": places["tracker"],
        "temperature_probe": places["probe"],
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


def _emulate_stage(seed: int, faults: list[str]) -> None:
    from service.emulated_hands import StagePerson, converse
    from service.emulated_stage import EmulatedStage, StageHands

    with EmulatedStage(seed) as addresses, closing(StageHands(addresses.stage_world)) as hands:
        person = StagePerson(addresses.wires, hands)
        _introduce(addresses)
        for text in faults:
            print(person.follow(text.replace(":", " ", 1)), flush=True)
        converse(person)


def _introduce(addresses: StageAddresses) -> None:
    """Say what to type into the page's form, or to send to POST /base-calibrations."""
    if addresses.note:
        print(addresses.note)
    print("body of POST /api/v1/base-calibrations, and what to type on the page:")
    print(json.dumps(addresses.request("emulated"), indent=1))
    print("lead a needle into a cup: ROBOT CUP SLIDE_MM ANGLE_DEG LENGTH_MM")
    print("for instance: master rod 0 0 350; a sensor's fault: slide silence, slide none")
    print("hidden faults of the stage, as a JSON object of sag_mm_at_m and others: faults OBJECT")
    print("end of input or Ctrl+C ends it", flush=True)

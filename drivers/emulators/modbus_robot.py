"""A robot controller that speaks Modbus TCP; its arm is the emulated world's.

``python -m drivers.emulators.modbus_robot --world HOST:PORT [--layout staubli_cs9] [--port 0]``
prints ``{"ready": true, "port": N}`` and ends when its standard input closes or the world does.
Standard input takes faults, each acknowledged by a line: ``{"fault": "cut_reply", "replies": 1}``,
see `modbus_wire`. No maker's controller is meant: the layouts are those of this project.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import sys

from drivers.emulators.modbus_controller import Controller
from drivers.emulators.modbus_layout import LAYOUTS, Layout
from drivers.emulators.modbus_wire import Fault, ModbusServer
from drivers.emulators.process import report_ready, until_stdin_closes
from drivers.emulators.world_link import WorldLink

UNIT = 1


async def switch_fault(server: ModbusServer, controller: Controller, order: str) -> None:
    """Follow one line of standard input and acknowledge it."""
    try:
        fault = Fault(**json.loads(order))
    except (TypeError, ValueError) as problem:
        acknowledgement = {"ok": False, "message": str(problem)}
    else:
        controller.frozen = fault.fault == "frozen"
        await server.switch(fault)
        acknowledgement = {"ok": True, "message": fault.fault}
    sys.stdout.write(json.dumps(acknowledgement) + "\n")
    sys.stdout.flush()


async def serve(world_address: str, layout: Layout, port: int) -> None:
    """Play the controller until standard input closes; fail when the world ends."""
    world = await WorldLink.open(world_address)
    hello = await world.ask("hello")
    controller = Controller(world, layout, hello["prismatic"])
    server = ModbusServer(controller, UNIT)
    await server.open(port)
    switching: set[asyncio.Task[None]] = set()

    def order(line: str) -> None:
        task = asyncio.ensure_future(switch_fault(server, controller, line))
        switching.add(task)
        task.add_done_callback(switching.discard)

    watching = asyncio.create_task(controller.watch())
    parent = asyncio.create_task(until_stdin_closes(order))
    report_ready(port=server.port)
    done, _ = await asyncio.wait({watching, parent}, return_when=asyncio.FIRST_COMPLETED)
    server.close()
    for task in (watching, parent):
        task.cancel()
    for task in done:
        task.result()


def main() -> int:
    """Run a controller."""
    parser = argparse.ArgumentParser(description="An emulated robot controller over Modbus TCP.")
    parser.add_argument("--world", required=True, help="host:port of the emulated world")
    parser.add_argument("--layout", choices=sorted(LAYOUTS), default="generic")
    parser.add_argument("--port", type=int, default=0, help="TCP port, 0 for a free one")
    options = parser.parse_args()
    try:
        asyncio.run(serve(options.world, LAYOUTS[options.layout], options.port))
    except ConnectionError as fault:
        sys.stderr.write(f"{fault}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

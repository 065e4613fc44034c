"""A UR controller on the wire: RTDE 30004, dashboard 29999, script port 30003.

``python -m drivers.emulators.ur_controller --world 127.0.0.1:PORT --address 127.0.0.2``

The ports are fixed because the client library's are; several controllers take several loopback
addresses. Prints one ready line and ends when standard input closes. Lines on standard input
switch faults, each answered by one line on standard output::

    {"fault": "silent", "on": true}           nothing heard, nothing said, connections stay open
    {"fault": "frozen", "on": true}           packages go on with old values and an old timestamp
    {"fault": "refused", "on": true}          connections cut, ports closed
    {"fault": "local_control", "on": true}    the pendant is not in remote control
    {"fault": "dropped"}                      present connections cut once
    {"fault": "none"}                         all of these over

Modelled on the client's source and the manuals; nothing of it was compared with a real robot.
"""

import argparse
import asyncio
import json
import sys
from collections.abc import Awaitable, Callable

from .process import report_ready, until_stdin_closes
from .ur_arm import Arm, WorldRefusedError
from .ur_controller_state import Controller
from .ur_dashboard import PORT as DASHBOARD_PORT
from .ur_dashboard import Dashboard
from .ur_rtde_server import CYCLE_HZ, RtdeServer
from .ur_rtde_server import PORT as RTDE_PORT
from .ur_script import ControlProgram

SCRIPT_PORT = 30003
IDLE_CYCLE_S = 0.04

Serve = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]


class Wires:
    """The listening ports of one controller, and the connections that came in through them."""

    def __init__(self, address: str, services: dict[int, Serve]) -> None:
        self._address = address
        self._services = services
        self._servers: list[asyncio.Server] = []
        self._connections: dict[asyncio.Task[None], asyncio.StreamWriter] = {}

    async def open(self) -> None:
        """Listen on every port, if it is not so already."""
        if self._servers:
            return
        for port, serve in self._services.items():
            self._servers.append(
                await asyncio.start_server(self._track(serve), self._address, port)
            )

    def drop(self) -> None:
        """Cut every connection."""
        for writer in self._connections.values():
            writer.close()

    def close(self) -> None:
        """Stop listening and cut every connection."""
        for server in self._servers:
            server.close()
        self._servers.clear()
        self.drop()

    def _track(self, serve: Serve) -> Callable[[asyncio.StreamReader, asyncio.StreamWriter], None]:
        def accept(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            task = asyncio.ensure_future(serve(reader, writer))
            self._connections[task] = writer
            task.add_done_callback(self._forget)

        return accept

    def _forget(self, task: asyncio.Future[None]) -> None:
        self._connections = {t: w for t, w in self._connections.items() if t is not task}


async def receive_script(
    controller: Controller, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
) -> None:
    """Load every program that ends with ``end`` in the first column."""
    try:
        while line := await reader.readline():
            if line.rstrip() == b"end" and not controller.faults.silent:
                await controller.program.load(asyncio.get_running_loop().time())
    except ConnectionError:
        return
    finally:
        writer.close()


async def run_cycles(controller: Controller, rtde: RtdeServer) -> None:
    """Run the controller's cycle for ever; slowly while nobody looks."""
    loop = asyncio.get_running_loop()
    cycle, due = 0, loop.time()
    while True:
        awake = rtde.streaming or controller.program.running
        due = max(due + (1.0 / CYCLE_HZ if awake else IDLE_CYCLE_S), loop.time())
        await asyncio.sleep(due - loop.time())
        await controller.cycle(loop.time())
        rtde.stream(cycle)
        cycle += 1


async def switch_fault(controller: Controller, wires: Wires, line: str) -> None:
    """Obey one line of standard input."""
    order = json.loads(line)
    match order["fault"]:
        case "silent":
            controller.faults.silent = order["on"]
        case "frozen":
            controller.faults.frozen = order["on"]
        case "local_control":
            controller.remote_control = not order["on"]
        case "dropped":
            wires.drop()
        case "refused" if order["on"]:
            wires.close()
        case "refused":
            await wires.open()
        case "none":
            controller.faults.silent = controller.faults.frozen = False
            controller.remote_control = True
            await wires.open()
        case unknown:
            raise SystemExit(f"ur_controller: there is no fault {unknown!r}")
    sys.stdout.write(json.dumps({"ok": True, **order}) + "\n")
    sys.stdout.flush()


async def emulate(world: str, address: str) -> None:
    """Serve until standard input closes."""
    host, _, port = world.rpartition(":")
    arm = await Arm.connect(host, int(port))
    controller = Controller(arm, ControlProgram(arm))
    rtde = RtdeServer(controller)
    wires = Wires(
        address,
        {
            RTDE_PORT: rtde.serve,
            DASHBOARD_PORT: Dashboard(controller).serve,
            SCRIPT_PORT: lambda reader, writer: receive_script(controller, reader, writer),
        },
    )
    await wires.open()
    async with asyncio.TaskGroup() as group:
        cycles = group.create_task(run_cycles(controller, rtde))

        def order(line: str) -> None:
            group.create_task(switch_fault(controller, wires, line))

        report_ready(address=address, rtde=RTDE_PORT, dashboard=DASHBOARD_PORT, script=SCRIPT_PORT)
        await until_stdin_closes(order)
        cycles.cancel()
        wires.close()


def main() -> None:
    """Start from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--world", required=True, help="HOST:PORT of the world's process")
    parser.add_argument("--address", required=True, help="loopback address to listen on")
    arguments = parser.parse_args()
    try:
        asyncio.run(emulate(arguments.world, arguments.address))
    except* (OSError, WorldRefusedError) as group:
        fault = f"at {arguments.address}, world {arguments.world}: {group.exceptions[0]}"
        raise SystemExit(f"ur_controller {fault}") from None


if __name__ == "__main__":
    main()

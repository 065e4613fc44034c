"""A total station on a serial port, speaking GeoCOM; the target is the emulated world's.

``python -m drivers.emulators.geocom_station --world HOST:PORT [--link PATH]`` prints
``{"ready": true, "port": "/dev/pts/N"}`` and ends when its standard input closes or the world
does. Standard input takes fault switches, see `geocom_faults`.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import sys
from pathlib import Path

from drivers.emulators.geocom_faults import Fault
from drivers.emulators.geocom_instrument import Station
from drivers.emulators.geocom_wire import (
    ABORT_MOTION,
    LINE_END,
    Reply,
    Request,
    RequestError,
    read_request,
    reply_line,
)
from drivers.emulators.process import report_ready, until_stdin_closes
from drivers.emulators.serial_line import SerialLine, serial_port
from drivers.emulators.world_link import WorldLink


class Conversation:
    """Requests answered in turn, with the faults that were asked for."""

    def __init__(self, line: SerialLine, station: Station) -> None:
        self._line = line
        self._station = station
        self._fault = Fault()

    def switch_fault(self, order: str) -> None:
        """Follow one line of standard input and acknowledge it."""
        try:
            self._fault = Fault(**json.loads(order))
            acknowledgement = {"ok": True, "fault": self._fault.fault}
        except (TypeError, ValueError) as fault:
            acknowledgement = {"ok": False, "message": str(fault)}
        sys.stdout.write(json.dumps(acknowledgement) + "\n")
        sys.stdout.flush()

    async def run(self) -> None:
        """Answer until cancelled."""
        while True:
            raw = await self._line.next_line()
            if raw == ABORT_MOTION:
                self._line.send(b"?" + LINE_END)
                continue
            try:
                request = read_request(raw)
            except RequestError as fault:
                unknown = Request(0, fault.transaction, checked=False, parameters=())
                self._line.send(reply_line(fault.code, unknown, Reply(0)))
                continue
            await self._answer(request)

    async def _answer(self, request: Request) -> None:
        communication, reply = await self._station.answer(request)
        fault = self._fault
        if not fault.hits(request.procedure):
            self._line.send(reply_line(communication, request, reply))
            return
        self._fault = fault.used()
        if fault.fault == "code":
            reply = Reply(fault.code, reply.values)
        await asyncio.sleep(fault.delay_s)
        self._line.send(fault.spoil(reply_line(communication, request, reply)))


async def serve(world_address: str, link: Path | None) -> None:
    """Play the station until standard input closes; fail when the world ends."""
    world = await WorldLink.open(world_address)
    with serial_port(link) as (instrument_end, port):
        line = SerialLine(instrument_end)
        conversation = Conversation(line, Station(world))
        talking = asyncio.create_task(conversation.run())
        parent = asyncio.create_task(until_stdin_closes(conversation.switch_fault))
        report_ready(port=str(link or port))
        done, _ = await asyncio.wait({talking, parent}, return_when=asyncio.FIRST_COMPLETED)
        line.close()
        for task in (talking, parent):
            task.cancel()
        for task in done:
            task.result()


def main() -> int:
    """Run a station."""
    parser = argparse.ArgumentParser(description="An emulated total station on a serial port.")
    parser.add_argument("--world", required=True, help="host:port of the emulated world")
    parser.add_argument("--link", type=Path, help="symbolic link to make to the serial port")
    options = parser.parse_args()
    try:
        asyncio.run(serve(options.world, options.link))
    except ConnectionError as fault:
        sys.stderr.write(f"{fault}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

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
from dataclasses import replace
from pathlib import Path

from drivers.emulators.geocom_faults import CABLE_KINDS, NOISE, WRONG_BAUD, Fault
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
from drivers.emulators.serial_instrument import cut_lines
from drivers.emulators.serial_plug import SerialPlug
from drivers.emulators.world_link import WorldLink

BAUD = 115200


class Conversation:
    """Requests answered in turn, with the faults that were asked for."""

    def __init__(self, station: Station, baud: int, link: Path | None) -> None:
        self._station = station
        self._fault = Fault()
        self._requests: asyncio.Queue[bytes] = asyncio.Queue()
        self._pending = b""
        self._before = b""
        self.plug = SerialPlug(baud, link, self._hear, lambda: self.plug.send(NOISE))

    def switch_fault(self, order: str) -> None:
        """Follow one line of standard input and acknowledge it."""
        try:
            fault = Fault(**json.loads(order))
        except (TypeError, ValueError) as problem:
            acknowledgement = {"ok": False, "message": str(problem)}
        else:
            self._switch(fault)
            acknowledgement = {"ok": True, "fault": fault.fault}
        sys.stdout.write(json.dumps(acknowledgement) + "\n")
        sys.stdout.flush()

    async def run(self) -> None:
        """Answer until cancelled."""
        while True:
            raw = await self._requests.get()
            if raw == ABORT_MOTION:
                self.plug.send(b"?" + LINE_END)
                continue
            try:
                request = read_request(raw)
            except RequestError as fault:
                unknown = Request(0, fault.transaction, checked=False, parameters=())
                self.plug.send(reply_line(fault.code, unknown, Reply(0)))
                continue
            await self._answer(request)

    async def _answer(self, request: Request) -> None:
        communication, reply = await self._station.answer(request)
        fault = self._fault
        if not fault.hits(request.procedure):
            self._before = reply_line(communication, request, reply)
            self.plug.send(self._before)
            return
        self._fault = fault.used()
        if fault.fault == "code":
            reply = Reply(fault.code, reply.values)
        if fault.fault == "wrong_id":
            request = replace(request, transaction=request.transaction + 1)
        await asyncio.sleep(fault.delay_s)
        self.plug.send(fault.spoil(reply_line(communication, request, reply), self._before))

    def _switch(self, fault: Fault) -> None:
        if fault.fault in CABLE_KINDS:
            (self.plug.plug if fault.fault == "plugged" else self.plug.unplug)()
        else:
            self.plug.mistune(wrong=fault.fault == WRONG_BAUD)
            self._fault = fault

    def _hear(self, received: bytes) -> None:
        requests, self._pending = cut_lines(self._pending + received)
        for request in requests:
            self._requests.put_nowait(request)


async def serve(world_address: str, baud: int, link: Path | None) -> None:
    """Play the station until standard input closes; fail when the world ends."""
    world = await WorldLink.open(world_address)
    conversation = Conversation(Station(world), baud, link)
    conversation.plug.plug()
    talking = asyncio.create_task(conversation.run())
    parent = asyncio.create_task(until_stdin_closes(conversation.switch_fault))
    report_ready(port=conversation.plug.port)
    done, _ = await asyncio.wait({talking, parent}, return_when=asyncio.FIRST_COMPLETED)
    conversation.plug.unplug()
    for task in (talking, parent):
        task.cancel()
    for task in done:
        task.result()


def main() -> int:
    """Run a station."""
    parser = argparse.ArgumentParser(description="An emulated total station on a serial port.")
    parser.add_argument("--world", required=True, help="host:port of the emulated world")
    parser.add_argument("--link", type=Path, help="symbolic link to make to the serial port")
    parser.add_argument("--baud", type=int, default=BAUD, help="speed set at the instrument")
    options = parser.parse_args()
    try:
        asyncio.run(serve(options.world, options.baud, options.link))
    except ConnectionError as fault:
        sys.stderr.write(f"{fault}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

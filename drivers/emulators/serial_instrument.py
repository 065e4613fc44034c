"""What every serial instrument's emulator does the same way: hear, answer, misbehave on request."""

from __future__ import annotations

import argparse
import asyncio
import json
import sys
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from drivers.emulators.process import report_ready, until_stdin_closes
from drivers.emulators.serial_plug import SerialPlug
from drivers.emulators.wire_faults import CABLE_KINDS, NOISE, WIRE_KINDS, Fault, Spoil, spoilt
from drivers.emulators.world_link import WorldLink

Cut = Callable[[bytes], tuple[list[bytes], bytes]]
"""From the bytes received to whole requests and the rest."""


@dataclass(frozen=True)
class Protocol:
    """What is particular to an instrument's wire."""

    cut: Cut
    answer: Callable[[bytes], Awaitable[bytes]]
    """From a request to the whole reply; empty where it would not answer."""
    spoil: Mapping[str, Spoil] = field(default_factory=dict)
    """Faults beyond those that every wire has."""
    stream: Callable[[Callable[[bytes], None]], Awaitable[None]] | None = None
    """For what it says by itself: called once with the way to say it."""


def cut_lines(pending: bytes) -> tuple[list[bytes], bytes]:
    """Cut at line ends; empty lines are no requests."""
    *lines, rest = pending.split(b"\n")
    return [line.strip() for line in lines if line.strip()], rest


class Conversation:
    """Requests answered in turn, with the faults that were asked for."""

    def __init__(self, protocol: Protocol, baud: int, link: Path | None) -> None:
        self._protocol = protocol
        self._requests: asyncio.Queue[bytes] = asyncio.Queue()
        self._pending = b""
        self._before = b""
        self._fault = Fault()
        self.plug = SerialPlug(baud, link, self._hear, self._garble)

    def switch_fault(self, order: str) -> None:
        """Follow one line of standard input and acknowledge it."""
        try:
            fault = Fault(**json.loads(order))
        except (TypeError, ValueError) as problem:
            return _acknowledge(ok=False, text=str(problem))
        kinds = (*WIRE_KINDS, *CABLE_KINDS, *self._protocol.spoil)
        if fault.fault not in kinds:
            return _acknowledge(ok=False, text=f"fault must be one of {', '.join(kinds)}")
        if fault.fault == "unplugged":
            self.plug.unplug()
        elif fault.fault == "plugged":
            self.plug.plug()
        else:
            self.plug.mistune(wrong=fault.fault == "wrong_baud")
            self._fault = fault
        return _acknowledge(ok=True, text=fault.fault)

    async def run(self) -> None:
        """Answer until cancelled."""
        tasks = [asyncio.ensure_future(self._answer_requests())]
        if self._protocol.stream is not None:
            tasks.append(asyncio.ensure_future(self._protocol.stream(self.say)))
        try:
            await asyncio.gather(*tasks)
        finally:
            for task in tasks:
                task.cancel()

    def say(self, reply: bytes) -> None:
        """Send one reply, spoilt if a fault is due."""
        fault = self._fault
        if fault.active:
            self._fault = fault.used()
            self.plug.send(spoilt(reply, self._before, fault, self._protocol.spoil))
            return
        self._before = reply
        self.plug.send(reply)

    async def _answer_requests(self) -> None:
        while True:
            reply = await self._protocol.answer(await self._requests.get())
            if reply:
                if self._fault.active:
                    await asyncio.sleep(self._fault.delay_s)
                self.say(reply)

    def _hear(self, received: bytes) -> None:
        requests, self._pending = self._protocol.cut(self._pending + received)
        for request in requests:
            self._requests.put_nowait(request)

    def _garble(self) -> None:
        self.plug.send(NOISE)


def _acknowledge(*, ok: bool, text: str) -> None:
    sys.stdout.write(json.dumps({"ok": ok, "message": text}) + "\n")
    sys.stdout.flush()


def instrument_options(description: str, baud: int) -> argparse.ArgumentParser:
    """Command line that every serial instrument has."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--world", required=True, help="host:port of the emulated world")
    parser.add_argument("--link", type=Path, help="symbolic link to make to the serial port")
    parser.add_argument("--baud", type=int, default=baud, help="speed set at the instrument")
    return parser


async def _serve(
    options: argparse.Namespace, make: Callable[[WorldLink, argparse.Namespace], Protocol]
) -> None:
    world = await WorldLink.open(options.world)
    conversation = Conversation(make(world, options), options.baud, options.link)
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


def play(
    parser: argparse.ArgumentParser, make: Callable[[WorldLink, argparse.Namespace], Protocol]
) -> int:
    """Play an instrument until standard input closes; status 1 when the world ends first."""
    try:
        asyncio.run(_serve(parser.parse_args(), make))
    except ConnectionError as fault:
        sys.stderr.write(f"{fault}\n")
        return 1
    return 0

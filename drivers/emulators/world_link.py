"""How an emulator asks the world: one JSON line out, one JSON line back."""

from __future__ import annotations

import asyncio
import json
from typing import Any


class WorldLink:
    """A connection to the emulated world; requests are answered in turn."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader = reader
        self._writer = writer
        self._turn = asyncio.Lock()

    @classmethod
    async def open(cls, address: str) -> WorldLink:
        """Connect to the world at ``host:port``."""
        host, _, port = address.rpartition(":")
        return cls(*await asyncio.open_connection(host, int(port)))

    async def ask(self, operation: str, **arguments: object) -> dict[str, Any]:
        """Return the world's reply, whether `ok` or not.

        Raises
        ------
        ConnectionError
            If the world has ended.
        """
        async with self._turn:
            self._writer.write(json.dumps({"op": operation, **arguments}).encode() + b"\n")
            await self._writer.drain()
            line = await self._reader.readline()
        if not line:
            raise ConnectionResetError("The world has ended.")
        reply: dict[str, Any] = json.loads(line)
        return reply

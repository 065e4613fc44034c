"""Somebody who stands in an emulated world: one line of JSON over a plain socket, one back."""

import json
import socket
from typing import Any


class WorldClient:
    """A connection to an emulated world or stage."""

    def __init__(self, address: str) -> None:
        host, _, port = address.rpartition(":")
        self._socket = socket.create_connection((host, int(port)), timeout=30)
        self._lines = self._socket.makefile("rw", encoding="utf-8")

    def ask(self, operation: str, **arguments: object) -> dict[str, Any]:
        """Ask the world; the reply says whether it was `ok`."""
        self._lines.write(json.dumps({"op": operation, **arguments}) + "\n")
        self._lines.flush()
        reply: dict[str, Any] = json.loads(self._lines.readline())
        return reply

    def close(self) -> None:
        """Leave the world."""
        self._lines.close()
        self._socket.close()

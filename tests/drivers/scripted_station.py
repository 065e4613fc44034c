"""A serial port on which a fixed conversation is played, for tests of drivers on their own."""

import os
import pty
import threading
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

Exchange = tuple[bytes, bytes]

PAUSE = b"{pause}"
"""In a reply: the instrument waits `PAUSE_S` here."""
PAUSE_S = 0.38


def exchanges(transcript: Path) -> list[Exchange]:
    """Requests and replies of a transcript, each without its line end."""
    lines = [line for line in transcript.read_bytes().splitlines() if not line.startswith(b"#")]
    requests, replies = lines[::2], lines[1::2]
    assert all(line.startswith(b"> ") for line in requests)
    assert all(line.startswith(b"< ") for line in replies)
    return [(a[2:], b[2:]) for a, b in zip(requests, replies, strict=True)]


def frames(transcript: Path) -> list[Exchange]:
    """Requests and replies of a transcript in hexadecimal bytes."""
    lines = [line for line in transcript.read_text().splitlines() if line[0] in "<>"]
    assert [line[0] for line in lines] == ["><"[i % 2] for i in range(len(lines))]
    sent = [bytes.fromhex(line[2:]) for line in lines]
    return [*zip(sent[::2], sent[1::2], strict=True)]


@contextmanager
def scripted_unit(conversation: list[Exchange]) -> Iterator[str]:
    """Give a serial port where requests have no line end; else like `scripted_station`."""
    instrument_end, port_end = pty.openpty()
    tty.setraw(port_end)
    heard: list[bytes] = []

    def play() -> None:
        for request, reply in conversation:
            received = b""
            while len(received) < len(request):
                received += os.read(instrument_end, len(request) - len(received))
            heard.append(received)
            os.write(instrument_end, reply)

    thread = threading.Thread(target=play)
    thread.start()
    try:
        yield os.ttyname(port_end)
    finally:
        os.write(port_end, bytes(1000))  # Wakes the reader if requests are missing.
        thread.join()
        os.close(instrument_end)
        os.close(port_end)
    assert heard == [request for request, _ in conversation]


@contextmanager
def scripted_station(conversation: list[Exchange]) -> Iterator[str]:
    """Give a serial port; at the end every request must have come, in this order, byte for byte.

    A reply is sent as it stands, so it holds its own line end, if any.
    """
    instrument_end, port_end = pty.openpty()
    tty.setraw(port_end)
    surprises: list[tuple[bytes, bytes]] = []
    left = list(conversation)

    def play() -> None:
        pending = b""
        while left:
            chunk = os.read(instrument_end, 4096)
            if chunk == b"\x04\x04\x04":
                return
            *lines, pending = (pending + chunk).split(b"\n")
            for line in filter(None, map(bytes.strip, lines)):
                expected, reply = left.pop(0)
                if line != expected:
                    surprises.append((line, expected))
                first, *rest = reply.split(PAUSE)
                os.write(instrument_end, first)
                for part in rest:
                    time.sleep(PAUSE_S)
                    os.write(instrument_end, part)

    thread = threading.Thread(target=play)
    thread.start()
    try:
        yield os.ttyname(port_end)
    finally:
        os.write(port_end, b"\x04\x04\x04")  # Wakes the reader if requests are missing.
        thread.join()
        os.close(instrument_end)
        os.close(port_end)
    assert surprises == []
    assert left == []

"""A real HTTP receiver that answers as it is told."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer


@dataclass
class Receiver:
    """What came, and what is answered: the statuses one after the other, then the last for ever."""

    url: str = ""
    statuses: list[int] = field(default_factory=lambda: [204])
    requests: list[tuple[dict[str, str], bytes]] = field(default_factory=list)

    def answer(self) -> int:
        return self.statuses.pop(0) if len(self.statuses) > 1 else self.statuses[0]


@contextmanager
def receiver(*statuses: int) -> Iterator[Receiver]:
    found = Receiver(statuses=list(statuses) or [204])

    class Answer(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            found.requests.append((dict(self.headers), body))
            status = found.answer()
            self.send_response(status)
            if 300 <= status < 400:
                self.send_header("Location", found.url + "/elsewhere")
            self.send_header("Content-Length", "0")
            self.end_headers()

        def log_message(self, *words: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Answer) as server:
        found.url = f"http://127.0.0.1:{server.server_address[1]}/hook"
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
        thread.start()
        try:
            yield found
        finally:
            server.shutdown()
            thread.join()


DRIP_S, DRIPS = 0.1, 40
"""Each byte comes soon after the one before, all of them take long."""


@dataclass
class Dripping:
    """Where it listens, and whether the sender left before the answer was complete."""

    url: str
    left: threading.Event = field(default_factory=threading.Event)


@contextmanager
def dripping_receiver() -> Iterator[Dripping]:
    """Answers 204 to one request, its headers a byte at a time."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        listening.settimeout(10.0)
        found = Dripping(f"http://127.0.0.1:{listening.getsockname()[1]}/hook")
        thread = threading.Thread(target=_drip, args=(listening, found.left))
        thread.start()
        try:
            yield found
        finally:
            thread.join()


def _drip(listening: socket.socket, left: threading.Event) -> None:
    connection, _ = listening.accept()
    with connection:
        connection.settimeout(DRIP_S)
        connection.sendall(b"HTTP/1.1 204 No Content\r\nX-Drip: ")
        for _ in range(DRIPS):
            connection.sendall(b"x")
            if _has_left(connection):
                left.set()
                return
        connection.sendall(b"\r\n\r\n")


def _has_left(connection: socket.socket) -> bool:
    """Read what comes for the time of a drip; whether that is the end of the connection."""
    try:
        while connection.recv(65536):
            pass
    except TimeoutError:
        return False
    except ConnectionError:
        pass
    return True

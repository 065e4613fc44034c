"""The application in this process, listening on a port of its own."""

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import httpx
import uvicorn

from service.main import create_app
from service.settings import Settings
from tests.credentials import BEARER

PATIENCE_S = 240.0
"""For an answer, on a machine that does ten other things."""


@contextmanager
def serving(settings: Settings) -> Iterator[httpx.Client]:
    """The service with these settings, for as long as the block lasts."""
    config = uvicorn.Config(create_app(settings), port=0, log_level="warning")
    server = uvicorn.Server(config)
    with socket.create_server(("127.0.0.1", 0)) as listening:
        thread = threading.Thread(target=server.run, args=([listening],))
        thread.start()
        # A test that locks the database must not meet the start.
        while thread.is_alive() and not server.started:
            time.sleep(0.005)
        port = listening.getsockname()[1]
        base_url = f"http://127.0.0.1:{port}/api/v1/"
        with httpx.Client(base_url=base_url, headers=BEARER, timeout=PATIENCE_S) as opened:
            yield opened
        server.should_exit = True
        thread.join()

"""A TCP server that sends fixed bytes, for replies that no sane device would send."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def scripted_server(*replies: bytes | None) -> Iterator[str]:
    """Answer each request line, over any number of connections, with the next of `replies`.

    None closes the connection in place of an answer; after the last reply there is silence.
    """
    script = iter(replies)
    open_sockets: list[socket.socket] = []
    listener = socket.create_server(("127.0.0.1", 0))

    def serve() -> None:
        while True:
            try:
                connection, _ = listener.accept()
            except OSError:
                return  # The listener was closed: the test is over.
            open_sockets.append(connection)
            with connection, connection.makefile("rb") as lines:
                for _ in lines:
                    reply = next(script, b"")
                    if reply is None:
                        break
                    connection.sendall(reply)

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield f"127.0.0.1:{listener.getsockname()[1]}"
    finally:
        # Closing a listening socket does not wake its accept; shutting it down does.
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()
        for connection in open_sockets:
            with connection:
                if connection.fileno() >= 0:
                    connection.shutdown(socket.SHUT_RDWR)
        thread.join()

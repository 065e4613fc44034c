"""The wish of the system or of a person that this program ends: SIGTERM or SIGINT."""

import signal
from queue import SimpleQueue
from threading import Event, Thread
from types import FrameType


def shutdown_by_signal() -> Event:
    """Return an event that SIGTERM and SIGINT set from now on; call it in the main thread.

    The handler sets no event itself: it may interrupt a wait for this very event, which then
    holds the event's lock, and the program would stand for ever. `SimpleQueue.put` is made to be
    interrupted by itself.
    """
    shutdown = Event()
    told: SimpleQueue[int] = SimpleQueue()

    def tell(number: int, frame: FrameType | None) -> None:
        told.put(number)

    def hear() -> None:
        told.get()
        shutdown.set()

    Thread(target=hear, name="shutdown", daemon=True).start()
    signal.signal(signal.SIGTERM, tell)
    signal.signal(signal.SIGINT, tell)
    return shutdown

"""Work beside other work: a thread that lives from entering a context to leaving it."""

from abc import ABC, abstractmethod
from threading import Event, Thread
from types import TracebackType
from typing import Self


class Background(ABC):
    """Context manager that runs `_run` in a thread of its own, and waits for its end.

    `_run` has to return soon after `_over` is set.
    """

    def __init__(self, name: str) -> None:
        self._over = Event()
        self._thread = Thread(target=self._run, name=name, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._over.set()
        self._thread.join()

    @abstractmethod
    def _run(self) -> None:
        """Do the work until `_over` is set, then what is left to do."""

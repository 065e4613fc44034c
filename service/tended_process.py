"""A program that runs beside this one and is started again when it dies."""

import logging
import threading
from types import TracebackType
from typing import Self

from service.child_process import ChildProcess

RESTART_S = 1.0
"""Pause before the next start [s]: a program that cannot live must not fill the machine."""

log = logging.getLogger("robocal.serve")


class TendedProcess:
    """`python -m MODULE ARGUMENTS`, one at a time, from entering this context to leaving it."""

    def __init__(self, module: str, *arguments: str) -> None:
        self._command = (module, *arguments)
        self._ending = threading.Event()
        self._exchange = threading.Lock()
        self._thread = threading.Thread(target=self._tend, daemon=True, name=module)

    def __enter__(self) -> Self:
        self._child = ChildProcess(*self._command)
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._ending.set()
        with self._exchange:
            self._child.close()
        self._thread.join()

    def _tend(self) -> None:
        while True:
            status = self._child.wait()
            if self._ending.wait(RESTART_S):
                return
            log.warning("%s ended with status %d; starting it again", self._command[0], status)
            with self._exchange:
                if self._ending.is_set():
                    return
                self._child.close()
                self._child = ChildProcess(*self._command)

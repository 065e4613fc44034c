"""A bar for a person who waits at a terminal: on standard error, gone when the work is done.

Results go to standard output, so that a pipe or a file never holds a part of the bar.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from robocal.progress import watched_by

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


@contextmanager
def progress_bar(*, as_json: bool = False) -> Iterator[None]:
    """Show how far the work inside the block is; nothing for a program that reads JSON."""
    if as_json or not sys.stderr.isatty():
        yield
        return
    # Loaded for a person alone: a program need not wait for it.
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description:28}"),
        BarColumn(),
        TextColumn("{task.fields[count]:>9}"),
        TimeElapsedColumn(),
    )
    with (
        Progress(
            *columns,
            console=Console(stderr=True),
            transient=True,
            redirect_stdout=False,
            redirect_stderr=False,
        ) as bar,
        watched_by(_Shown(bar)),
    ):
        yield


class _Shown:
    """Puts what is told into one line, which begins anew with every kind of work."""

    def __init__(self, bar: "Progress") -> None:
        self._bar = bar
        self._work = ""
        self._task: TaskID | None = None

    def __call__(self, work: str, done: int, total: int | None) -> None:
        if work != self._work or self._task is None:
            if self._task is not None:
                self._bar.remove_task(self._task)
            self._work = work
            self._task = self._bar.add_task(work, total=total, count="")
        count = f"{done}/{total}" if total is not None else str(done or "")
        self._bar.update(self._task, completed=done, total=total, count=count)

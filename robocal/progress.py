"""How far long work has come, told to whoever watches it.

The watcher stands in a context variable and not in a parameter: the numerics are the same functions
whether somebody watches or not, and every thread has a watcher of its own.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

Watcher = Callable[[str, int, int | None], None]
"""Takes the name of the work, the steps done, and the steps in all where that is known."""

_Step = TypeVar("_Step")


def _nobody(work: str, done: int, total: int | None) -> None:
    """Watch nothing."""


_WATCHER: ContextVar[Watcher] = ContextVar("watcher", default=_nobody)


@contextmanager
def watched_by(watcher: Watcher) -> Iterator[None]:
    """Let a watcher hear of all work inside the block."""
    token = _WATCHER.set(watcher)
    try:
        yield
    finally:
        _WATCHER.reset(token)


def tell(work: str, done: int = 0, total: int | None = None) -> None:
    """Say what is being done now, and how much of it is done."""
    _WATCHER.get()(work, done, total)


def counted(work: str, steps: Iterable[_Step], total: int | None) -> Iterator[_Step]:
    """The steps, each told of when it is done."""
    tell(work, 0, total)
    for done, step in enumerate(steps, 1):
        yield step
        tell(work, done, total)

"""A worker whose database is of no use says so and waits, for somebody will bring it back."""

import logging
from pathlib import Path
from threading import Event

import pytest

from service.jobs.queues import open_queue
from service.jobs.worker import Worker, log


class FirstWord(logging.Handler):
    """Keeps what is said and wants the worker to end then."""

    def __init__(self, shutdown: Event) -> None:
        super().__init__()
        self.said: list[str] = []
        self.shutdown = shutdown

    def emit(self, record: logging.LogRecord) -> None:
        self.said.append(record.getMessage())
        self.shutdown.set()


@pytest.fixture
def first_word():
    """What a worker says first, and the end of it."""
    handler = FirstWord(Event())
    log.addHandler(handler)
    yield handler
    log.removeHandler(handler)


def test_a_worker_waits_until_a_damaged_database_is_restored(settings, database, first_word):
    queue = open_queue(database, settings.lease_s)
    database.close()
    Path(settings.database_url.removeprefix("sqlite:///")).write_bytes(b"no database" * 1000)
    Worker("w", database, queue, settings, first_word.shutdown).run()
    (said,) = first_word.said
    assert said.startswith("trying again: The database is damaged")

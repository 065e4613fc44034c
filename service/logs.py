"""Logs on standard error: one JSON object a line, with the job and the cell it is about.

At a terminal the same lines are written for a person. What the libraries log goes the same way.
"""

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import structlog
from structlog.contextvars import bound_contextvars
from structlog.typing import Processor

from service.jobs.queue import Claim

_QUIET = ("alembic", "httpx", "uvicorn.access")

_SHARED: tuple[Processor, ...] = (
    structlog.contextvars.merge_contextvars,
    structlog.stdlib.add_log_level,
    structlog.stdlib.add_logger_name,
    structlog.processors.TimeStamper(fmt="iso", utc=True),
)


def set_up_logs(program: str) -> None:
    """Write everything from INFO up, each line naming the program it comes from."""
    to_person = sys.stderr.isatty()
    last: tuple[Processor, ...] = (
        (structlog.dev.ConsoleRenderer(),)
        if to_person
        else (structlog.processors.format_exc_info, structlog.processors.JSONRenderer())
    )
    outlet = logging.StreamHandler(sys.stderr)
    outlet.setFormatter(
        structlog.stdlib.ProcessorFormatter(
            foreign_pre_chain=_SHARED,
            processors=(structlog.stdlib.ProcessorFormatter.remove_processors_meta, *last),
        )
    )
    logging.basicConfig(level=logging.INFO, handlers=[outlet], force=True)
    for name in _QUIET:
        logging.getLogger(name).setLevel(logging.WARNING)
    structlog.contextvars.bind_contextvars(program=program)


@contextmanager
def about(claim: Claim) -> Iterator[None]:
    """Let every line in the block name the job, its campaign and its cell."""
    with bound_contextvars(
        job=claim.job, campaign=claim.campaign, cell=claim.cell, kind=claim.kind, fence=claim.fence
    ):
        yield

"""All figures of one application, for a monitor such as Prometheus."""

from fastapi import FastAPI
from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.exposition import CONTENT_TYPE_LATEST
from prometheus_client.process_collector import ProcessCollector

from service.db.engine import Database
from service.jobs.queue import JobQueue
from service.metrics.requests import Counted, RequestFigures
from service.metrics.stock import Stock

CONTENT_TYPE = CONTENT_TYPE_LATEST


def install(app: FastAPI) -> None:
    """Count the application's requests from now on."""
    registry = CollectorRegistry()
    ProcessCollector(registry=registry)
    app.state.figures = registry
    app.add_middleware(Counted, noted=RequestFigures(registry))


def watch_stock(app: FastAPI, database: Database, queue: JobQueue) -> None:
    """Show what the database holds as well, once there is one."""
    app.state.figures.register(Stock(database, queue))


def figures(app: FastAPI) -> bytes:
    """Return the figures as text."""
    registry: CollectorRegistry = app.state.figures
    return generate_latest(registry)

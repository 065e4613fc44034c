"""The service: `python -m service.main` listens; with `--openapi` it prints the API instead."""

import json
import socket
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from importlib.metadata import version

import uvicorn
from fastapi import APIRouter, FastAPI

from service import errors, health
from service.campaigns.router import router as campaigns_router
from service.cells.router import router as cells_router
from service.db.engine import open_database
from service.db.upgrade import upgrade_schema
from service.guard import Guard
from service.jobs.table_queue import TableQueue
from service.parameters.router import router as parameters_router
from service.parent import end_with_parent
from service.settings import Settings
from service.start_up import listening_socket, prepare_database
from service.web.router import router as web_router

STOP_GRACE_S = 3
"""How long live pages may keep the service from ending [s]."""


def create_app(settings: Settings) -> FastAPI:
    """Make the application, which opens and upgrades its database when it starts."""

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        database = open_database(settings.database_url, settings.busy_s)
        upgrade_schema(database)
        app.state.settings = settings
        app.state.database = database
        app.state.queue = TableQueue(database, settings.lease_s)
        yield
        database.close()

    app = FastAPI(
        title="robocal",
        version=version("robocal"),
        description="Robot-cell calibration service. Units stand in every field's name.",
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        responses={"default": {"model": errors.ProblemDocument, "description": "Problem"}},
    )
    errors.install(app)
    app.add_middleware(Guard, hosts=settings.hosts)
    api = APIRouter(prefix="/api/v1")
    for router in (cells_router, campaigns_router, parameters_router):
        api.include_router(router)
    app.include_router(api)
    app.include_router(health.router)
    app.include_router(web_router)
    return app


class _Server(uvicorn.Server):
    """Says in one line of JSON where it listens, since port 0 means any."""

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            host, port = self.servers[0].sockets[0].getsockname()[:2]
            sys.stdout.write(json.dumps({"ready": True, "url": f"http://{host}:{port}"}) + "\n")
            sys.stdout.flush()


def serve(settings: Settings) -> None:
    """Prepare the database, and listen until told to stop; raises `BadInput`."""
    prepare_database(settings)
    with listening_socket(settings) as listener:
        listen(settings, listener)


def listen(settings: Settings, listener: socket.socket) -> None:
    """Answer what comes to the address until told to stop."""
    config = uvicorn.Config(
        create_app(settings), log_level="warning", timeout_graceful_shutdown=STOP_GRACE_S
    )
    _Server(config).run([listener])


def openapi_text() -> str:
    """Return the API's description as committed in `openapi.json`."""
    document = create_app(Settings()).openapi()
    return json.dumps(document, indent=1, sort_keys=True, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    if sys.argv[1:] == ["--openapi"]:
        sys.stdout.write(openapi_text())
    else:
        end_with_parent()
        serve(Settings())

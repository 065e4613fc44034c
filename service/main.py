"""The service: `python -m service.main` listens; with `--openapi` it prints the API instead."""

import json
import logging
import socket
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from importlib.metadata import version

import uvicorn
from fastapi import APIRouter, FastAPI

from service import api_examples, errors, health
from service.access import setup
from service.access.own_router import router as own_router
from service.access.people import LINK_HOURS
from service.access.router import router as access_router
from service.base_calibrations.live import LiveStages
from service.base_calibrations.router import router as base_calibrations_router
from service.base_calibrations.transforms_router import router as base_transforms_router
from service.campaigns.results_router import router as results_router
from service.campaigns.router import router as campaigns_router
from service.campaigns.shared_looks import SharedLooks
from service.campaigns.stop_flag import lower_all
from service.cells.router import router as cells_router
from service.certificate.router import router as certificate_router
from service.compensation.router import router as compensation_router
from service.db.engine import open_database
from service.db.upgrade import upgrade_schema
from service.found import unfinished
from service.health_checks.router import router as health_checks_router
from service.jobs.queues import open_queue
from service.logs import set_up_logs
from service.metrics import figures
from service.parameters.answers import Answers
from service.parameters.router import router as parameters_router
from service.parent import end_with_parent
from service.settings import Settings
from service.start_up import keep_what_is_loaded, listening_socket, prepare_database
from service.web.access_router import router as access_pages
from service.web.base_calibration_router import router as base_calibration_pages
from service.web.diagnosis_page import router as diagnosis_page
from service.web.history_router import router as history_router
from service.web.preferences import ReadPreferences
from service.web.problem_pages import ProblemPages
from service.web.router import router as web_router
from service.web.view_router import router as view_router
from service.webhooks.router import router as webhooks_router

log = logging.getLogger("robocal.service")

STOP_GRACE_S = 3
"""How long live pages may keep the service from ending [s]."""


def create_app(settings: Settings) -> FastAPI:
    """Make the application, which opens and upgrades its database when it starts."""

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        database = open_database(settings.database_url, settings.busy_s)
        upgrade_schema(database)
        lower_all(database)
        app.state.settings = settings
        app.state.database = database
        app.state.queue = open_queue(database, settings.lease_s)
        app.state.parameter_answers = Answers()
        # Half of a page's own period: what a page shows is as fresh as if it looked itself.
        app.state.looks = SharedLooks(database, settings.events_poll_s / 2.0)
        figures.watch_stock(app, database, app.state.queue)
        with database.read() as session:
            for sentence in unfinished(session, app.state.queue):
                log.warning("found at the start: %s", sentence)
        app.state.stages = LiveStages()
        with setup.admitted(app, settings, database):
            yield
        app.state.stages.close()
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
    setup.install(app, settings)
    app.add_middleware(ProblemPages)
    app.add_middleware(ReadPreferences)
    figures.install(app)
    api_examples.install(app)
    api = APIRouter(prefix="/api/v1", max_body_size=int(settings.json_max_mb * 1e6))
    for router in (
        # First, because routes are tried in this order and an MES reads all day.
        parameters_router,
        own_router,
        access_router,
        cells_router,
        campaigns_router,
        results_router,
        compensation_router,
        webhooks_router,
        base_calibrations_router,
        base_transforms_router,
        health_checks_router,
        certificate_router,
    ):
        api.include_router(router)
    app.include_router(api)
    for router in (
        health.router,
        web_router,
        diagnosis_page,
        base_calibration_pages,
        view_router,
        history_router,
        access_pages,
    ):
        app.include_router(router)
    setup.require_listed(app)
    return app


class _Server(uvicorn.Server):
    """Says when it listens, and on which port, since port 0 means any."""

    def __init__(self, config: uvicorn.Config, ready: Callable[[str], None]) -> None:
        super().__init__(config)
        self._ready = ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            keep_what_is_loaded()
            host, port = self.servers[0].sockets[0].getsockname()[:2]
            scheme = "https" if self.config.is_ssl else "http"
            self._ready(f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}")


def serve(settings: Settings) -> None:
    """Prepare the database, and listen until told to stop; raises `BadInput`."""
    prepare_database(settings)
    with listening_socket(settings) as listener:
        listen(settings, listener)


def listen(settings: Settings, listener: socket.socket) -> None:
    """Answer what comes to the address until told to stop."""
    set_up_logs("service")
    logging.getLogger().setLevel(settings.log_level)
    # Before the server listens to signals: what waits for the database here can be ended.
    link = setup.prepare_access(settings)
    app = create_app(settings)
    password = settings.tls_key_password
    config = uvicorn.Config(
        app,
        log_config=None,
        log_level="warning",
        timeout_graceful_shutdown=STOP_GRACE_S,
        proxy_headers=bool(settings.proxies),
        forwarded_allow_ips=list(settings.proxies),
        server_header=False,
        ssl_certfile=settings.tls_cert,
        ssl_keyfile=settings.tls_key,
        ssl_keyfile_password=None if password is None else password.get_secret_value(),
    )

    def ready(url: str) -> None:
        if link is not None:
            sys.stderr.write(
                f"robocal: nobody can log in yet; open {url}{link} within "
                f"{LINK_HOURS:g} hours, once, to make the first engineer\n"
            )
            sys.stderr.flush()
        sys.stdout.write(json.dumps({"ready": True, "url": url}) + "\n")
        sys.stdout.flush()

    _Server(config, ready).run([listener])


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

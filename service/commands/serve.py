"""`robocal serve`."""

import signal
from contextlib import nullcontext
from types import FrameType
from typing import Annotated

import typer


class _Terminated(BaseException):
    """SIGTERM came: a reason to leave every context, and no error."""


def serve(
    host: Annotated[str | None, typer.Option(help="address to listen on")] = None,
    port: Annotated[int | None, typer.Option(min=0, max=65535, help="0 takes a free one")] = None,
    *,
    worker: Annotated[bool, typer.Option(help="also run a worker beside the service")] = True,
) -> None:
    """Run the service (REST and web page) and a worker; settings come from ROBOCAL_* variables."""
    from service.main import listen
    from service.parent import WITH_PARENT
    from service.start_up import listening_socket, prepare_database, read_settings
    from service.tended_process import TendedProcess

    settings = read_settings(host=host, port=port)
    prepare_database(settings)
    # When all requests are answered uvicorn sends itself the signal that it got once more.
    signal.signal(signal.SIGTERM, _leave)
    try:
        with listening_socket(settings) as listener:
            beside = TendedProcess("service.jobs.worker", WITH_PARENT) if worker else nullcontext()
            with beside:
                listen(settings, listener)
    except _Terminated:
        # Supervisors take a death by the signal that they sent for a clean end.
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        signal.raise_signal(signal.SIGTERM)


def _leave(number: int, frame: FrameType | None) -> None:
    raise _Terminated

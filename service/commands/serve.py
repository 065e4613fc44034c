"""`robocal serve`."""

from contextlib import nullcontext
from typing import Annotated

import typer


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
    with listening_socket(settings) as listener:
        beside = TendedProcess("service.jobs.worker", WITH_PARENT) if worker else nullcontext()
        with beside:
            listen(settings, listener)

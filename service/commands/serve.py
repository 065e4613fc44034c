"""`robocal serve`."""

from typing import Annotated

import typer


def serve(
    host: Annotated[str | None, typer.Option(help="address to listen on")] = None,
    port: Annotated[int | None, typer.Option(min=1, max=65535)] = None,
    *,
    worker: Annotated[bool, typer.Option(help="also run a worker beside the service")] = True,
) -> None:
    """Run the service (REST and web page) and its worker."""
    from service.serve import serve as run

    run(host, port, with_worker=worker)

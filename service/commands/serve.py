"""`robocal serve`."""

from contextlib import nullcontext
from typing import Annotated, Any

import typer


def serve(
    host: Annotated[str | None, typer.Option(help="address to listen on")] = None,
    port: Annotated[int | None, typer.Option(min=0, max=65535, help="0 takes a free one")] = None,
    *,
    worker: Annotated[bool, typer.Option(help="also run a worker beside the service")] = True,
) -> None:
    """Run the service (REST and web page) and a worker; settings come from ROBOCAL_* variables."""
    from pydantic import ValidationError

    from robocal.errors import BadInput
    from service.main import listen
    from service.parent import WITH_PARENT
    from service.settings import Settings
    from service.start_up import listening_socket, prepare_database
    from service.tended_process import TendedProcess

    given: dict[str, Any] = {"host": host, "port": port}
    try:
        settings = Settings(**{name: value for name, value in given.items() if value is not None})
    except ValidationError as error:
        first = error.errors()[0]
        raise BadInput(f"setting {'.'.join(map(str, first['loc']))}", first["msg"]) from None
    prepare_database(settings)
    with listening_socket(settings) as listener:
        beside = TendedProcess("service.jobs.worker", WITH_PARENT) if worker else nullcontext()
        with beside:
            listen(settings, listener)

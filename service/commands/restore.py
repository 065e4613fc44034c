"""`robocal restore`."""

from pathlib import Path
from typing import Annotated

import typer


def restore(
    file: Annotated[Path, typer.Argument(help="what `robocal backup` wrote")],
    *,
    replace: Annotated[
        bool, typer.Option("--replace", help="replace what the database holds, after a backup")
    ] = False,
) -> None:
    """Bring a backup into the database of the settings; no worker may be at work on it."""
    import sqlite3

    from sqlalchemy.exc import DBAPIError

    from robocal.errors import BadInput
    from service.backup import keeping
    from service.backup_lines import DISARMED, copied_lines
    from service.db.engine import open_database, sqlite_file
    from service.start_up import read_settings

    settings = read_settings()
    database = open_database(settings.database_url, settings.busy_s)
    try:
        restored, before = keeping.restore(file, database, settings.lease_s, replace=replace)
    except (DBAPIError, sqlite3.Error) as error:
        place = sqlite_file(settings.database_url) or "the server"
        cause = error.orig if isinstance(error, DBAPIError) else error
        raise BadInput(
            "setting database_url",
            f"{place} cannot be used as the database ({cause}); nothing was restored",
        ) from None
    finally:
        database.close()
    print(copied_lines(restored))
    print(DISARMED)
    if before is not None:
        print(f"what was there before is in {before}")

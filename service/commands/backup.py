"""`robocal backup`."""

from pathlib import Path
from typing import Annotated

import typer


def backup(file: Annotated[Path, typer.Argument(help="new file")]) -> None:
    """Back the database up into one file, while the service and its workers go on."""
    from service.backup.keeping import back_up
    from service.backup_lines import copied_lines
    from service.db.engine import open_database
    from service.start_up import read_settings

    settings = read_settings()
    database = open_database(settings.database_url, settings.busy_s)
    try:
        kept = back_up(database, file, settings.lease_s)
    finally:
        database.close()
    print(copied_lines(kept))
    print(f"kept in {file}")

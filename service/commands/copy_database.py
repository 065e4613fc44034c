"""`robocal copy-database`."""

from typing import Annotated

import typer


def copy_database(
    source: Annotated[str, typer.Argument(help="sqlite:///folder/file.sqlite3")],
    target: Annotated[str, typer.Argument(help="postgresql+psycopg://person@host/database")],
) -> None:
    """Copy a database into an empty one of the same or the other kind, and compare every row."""
    from service.backup import copying
    from service.backup_lines import DISARMED, copied_lines
    from service.db.engine import open_database
    from service.start_up import prepare_database, read_settings

    settings = read_settings(database_url=target)
    prepare_database(settings)
    received = open_database(settings.database_url, settings.busy_s)
    sent = open_database(read_settings(database_url=source).database_url, settings.busy_s)
    try:
        copied = copying.copy_database(sent, received, settings.lease_s)
    finally:
        sent.close()
        received.close()
    print(copied_lines(copied))
    print("every row arrived as it was sent")
    print(DISARMED)

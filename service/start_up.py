"""What has to be in place before the service listens; each fault in one sentence."""

import gc
import socket
from typing import Any

from alembic.util import CommandError
from pydantic import ValidationError
from sqlalchemy.exc import ArgumentError, DBAPIError

from robocal.errors import BadInput
from service.db.engine import open_database, sqlite_file
from service.db.trouble import Trouble, is_damaged, trouble_of
from service.db.upgrade import upgrade_schema
from service.db.waiting import when_free
from service.settings import Settings


def read_settings(**given: object) -> Settings:
    """Return the environment's settings, with those given in their place.

    Raises
    ------
    BadInput
        If a setting cannot be what it is.
    """
    wanted: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    try:
        return Settings(**wanted)
    except ValidationError as error:
        first = error.errors()[0]
        where = " ".join(["setting", *map(str, first["loc"])])
        raise BadInput(where, first["msg"].removeprefix("Value error, ")) from None


def keep_what_is_loaded() -> None:
    """Never look again for garbage in what the start has made; the rest is looked through.

    A look through all of it holds every thread up for 0.05 s on an idle machine and 0.3 s on a
    busy one: answers of the service wait, and the watchdog of a moving arm has 0.15 s.
    """
    gc.collect()
    gc.freeze()


def prepare_database(settings: Settings) -> None:
    """Make the database or bring it up to this program; waits while another one keeps it locked.

    Raises
    ------
    BadInput
        If there is none at the address, or none that this program can use.
    """
    setting, url = "setting database_url", settings.database_url
    try:
        database = open_database(url, settings.busy_s)
        try:
            when_free(lambda: upgrade_schema(database))
        finally:
            database.close()
    except ArgumentError:
        # The address is not repeated: it may hold a password.
        raise BadInput(
            setting,
            "this is no address of a database that is known here; "
            "write it as sqlite:///folder/file.sqlite3 or postgresql+psycopg://person@host/database",
        ) from None
    except ImportError as error:
        raise BadInput(
            setting,
            f"the Python package '{error.name}', which speaks to it, is missing; install it",
        ) from None
    except OSError as error:
        raise BadInput(
            setting, f"the folder '{error.filename}' cannot be made ({error.strerror})"
        ) from None
    except DBAPIError as error:
        place = sqlite_file(url) or "the server"
        advice = "name another one"
        if trouble_of(error) is Trouble.disk_full:
            advice = "its disk is full, make room there"
        if is_damaged(error):
            advice = (
                "bring a backup back with 'robocal restore FILE --replace', or name another one"
            )
        raise BadInput(
            setting, f"{place} cannot be used as the database ({error.orig}); {advice}"
        ) from None
    except CommandError as error:
        raise BadInput(
            setting, f"the database was made by another version of robocal ({error})"
        ) from None


def listening_socket(settings: Settings) -> socket.socket:
    """Take the address before anything else is started; raises `BadInput` if it is in use."""
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    try:
        return socket.create_server((settings.host, settings.port), family=family)
    except OSError as error:
        raise BadInput(
            "setting port",
            f"{settings.host}:{settings.port} cannot be listened on "
            f"({error.strerror}); choose another port, 0 takes a free one",
        ) from None

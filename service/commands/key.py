"""`robocal key`."""

from enum import StrEnum
from typing import Annotated

import typer


class KeyAction(StrEnum):
    """What to do with keys."""

    add = "add"
    list = "list"
    revoke = "revoke"


class KeyScope(StrEnum):
    """What a program may do with a key."""

    read = "read"
    operate = "operate"
    engineer = "engineer"


def key(
    action: Annotated[KeyAction, typer.Argument()],
    name: Annotated[str, typer.Argument(help="of the key, to tell programs apart")] = "",
    scope: Annotated[
        KeyScope, typer.Option(help="read, also operate the cells, or do everything")
    ] = KeyScope.read,
) -> None:
    """Make, list or revoke the keys with which programs call the service."""
    from robocal.errors import BadInput
    from service.access import at_the_desk
    from service.access.models import is_key_name
    from service.access.scopes import Scope
    from service.settings import Settings

    settings = Settings()
    if action is KeyAction.list:
        print("\n".join(at_the_desk.key_lines(settings)) or "no keys")
        return
    if not is_key_name(name):
        raise BadInput("key NAME", "name the key with letters, digits, dot, hyphen, underscore")
    if action is KeyAction.revoke:
        at_the_desk.revoke_key(settings, name)
        print(f"{name} is revoked")
        return
    made = at_the_desk.add_key(settings, name, Scope(scope))
    print(f"Authorization: Bearer {made}")

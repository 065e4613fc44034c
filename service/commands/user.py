"""`robocal user`."""

from enum import StrEnum
from typing import Annotated

import typer


class UserAction(StrEnum):
    """What to do with users."""

    add = "add"
    list = "list"
    link = "link"
    disable = "disable"


class UserRole(StrEnum):
    """What a person may do."""

    operate = "operate"
    engineer = "engineer"


def user(
    action: Annotated[UserAction, typer.Argument()],
    name: Annotated[str, typer.Argument(help="small letters, digits, dot, hyphen")] = "",
    role: Annotated[UserRole, typer.Option(help="operate cells, or do everything")] = (
        UserRole.operate
    ),
) -> None:
    """Make or disable people who log in on the page; `link` gives a new way to a password."""
    from robocal.errors import BadInput
    from service.access import at_the_desk
    from service.access.models import is_person_name
    from service.access.scopes import Scope
    from service.settings import Settings

    settings = Settings()
    if action is UserAction.list:
        print("\n".join(at_the_desk.user_lines(settings)) or "no users")
        return
    if not is_person_name(name):
        raise BadInput("user NAME", "use small letters, digits, dot, hyphen and underscore")
    if action is UserAction.disable:
        at_the_desk.disable_user(settings, name)
        print(f"{name} is disabled")
    elif action is UserAction.add:
        print(f"open once: {at_the_desk.add_user(settings, name, Scope(role))}")
    else:
        print(f"open once: {at_the_desk.link_user(settings, name)}")

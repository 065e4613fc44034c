"""Who may call what: one line for every route, and no way in for a route without one.

A scope includes those before it. Programs get theirs with their key, people with their role
(operator: `operate`). `public` is for what must work before anybody is known.
"""

import re
from dataclasses import dataclass
from enum import StrEnum

from starlette.routing import compile_path


class Scope(StrEnum):
    """What a caller may do."""

    public = "public"
    read = "read"
    operate = "operate"
    engineer = "engineer"

    def covers(self, needed: "Scope") -> bool:
        """Whether it is at least the needed one."""
        order = list(Scope)
        return order.index(self) >= order.index(needed)


WHO_MAY: dict[str, Scope] = {
    # Before anybody is known
    "GET /healthz": Scope.public,
    "GET /readyz": Scope.public,
    "GET /openapi.json": Scope.public,
    "GET /assets/{collection}/{version}/{file}": Scope.public,
    "GET /login": Scope.public,
    "GET /welcome": Scope.public,
    "POST /api/v1/login": Scope.public,
    "POST /api/v1/welcome": Scope.public,
    # Looking: pages, results, and what the MES asks for
    "GET /": Scope.read,
    "GET /cells/{name}": Scope.read,
    "GET /compare": Scope.read,
    "GET /campaigns": Scope.read,
    "GET /campaigns/{number}": Scope.read,
    "GET /base-calibrations": Scope.read,
    "GET /base-calibrations/{number}": Scope.read,
    "GET /parts/cells": Scope.read,
    "GET /parts/cells/{name}": Scope.read,
    "GET /parts/cells/{name}/check": Scope.read,
    "GET /parts/cells/{name}/plan": Scope.operate,
    "GET /parts/campaigns": Scope.read,
    "GET /parts/campaigns/{number}/tips": Scope.read,
    "GET /parts/campaigns/{number}/live": Scope.read,
    "GET /parts/campaigns/{number}/result": Scope.read,
    "GET /parts/campaigns/{number}/diagnosis": Scope.read,
    "GET /api/v1/cells": Scope.read,
    "GET /api/v1/cells/{cell}": Scope.read,
    "GET /api/v1/cells/{cell}/parameters": Scope.read,
    "GET /api/v1/cells/{cell}/parameters/versions": Scope.read,
    "GET /api/v1/cells/{cell}/parameters/history": Scope.read,
    "POST /api/v1/cells/{cell}/compensate": Scope.read,
    "GET /api/v1/cells/{cell}/health": Scope.read,
    "GET /metrics": Scope.read,
    "GET /api/v1/campaigns": Scope.read,
    "GET /api/v1/campaigns/{campaign}": Scope.read,
    "GET /api/v1/campaigns/{campaign}/events": Scope.read,
    "GET /api/v1/campaigns/{campaign}/measurements": Scope.read,
    "GET /api/v1/campaigns/{campaign}/poses": Scope.read,
    "GET /parts/campaigns/{number}/skipped": Scope.read,
    "GET /api/v1/campaigns/{campaign}/bundle": Scope.read,
    "GET /api/v1/campaigns/{campaign}/identification": Scope.read,
    "GET /api/v1/campaigns/{campaign}/uncertainty": Scope.read,
    "GET /api/v1/campaigns/{campaign}/verification": Scope.read,
    "GET /api/v1/campaigns/{campaign}/health": Scope.read,
    "GET /api/v1/campaigns/{campaign}/diagnosis": Scope.read,
    "GET /api/v1/campaigns/{campaign}/report": Scope.read,
    "GET /api/v1/campaigns/{campaign}/next_poses": Scope.read,
    "GET /api/v1/campaigns/{campaign}/computations/{number}": Scope.read,
    "GET /api/v1/campaigns/{campaign}/certificate": Scope.read,
    "GET /api/v1/base-calibrations": Scope.read,
    "GET /api/v1/base-calibrations/{number}": Scope.read,
    "GET /api/v1/base-calibrations/{number}/sensors": Scope.read,
    "GET /api/v1/base-calibrations/{number}/result": Scope.read,
    "GET /api/v1/base-calibrations/{number}/bundle": Scope.read,
    "GET /api/v1/base-transforms/{name}": Scope.read,
    "GET /api/v1/base-transforms/{name}/versions": Scope.read,
    # Oneself
    "GET /account": Scope.read,
    "GET /api/v1/me": Scope.read,
    "POST /api/v1/logout": Scope.read,
    "POST /api/v1/password": Scope.read,
    # Work at the cell
    "POST /api/v1/cells/{cell}/check": Scope.operate,
    "POST /api/v1/cells/{cell}/arm": Scope.operate,
    "POST /api/v1/cells/{cell}/disarm": Scope.operate,
    "POST /api/v1/campaigns": Scope.operate,
    "POST /api/v1/campaigns/import": Scope.operate,
    "POST /api/v1/campaigns/{campaign}/pause": Scope.operate,
    "POST /api/v1/campaigns/{campaign}/resume": Scope.operate,
    "POST /api/v1/campaigns/{campaign}/abort": Scope.operate,
    "POST /api/v1/campaigns/{campaign}/identification": Scope.operate,
    "POST /api/v1/campaigns/{campaign}/diagnosis": Scope.operate,
    "DELETE /api/v1/campaigns/{campaign}/computations/{number}": Scope.operate,
    "POST /api/v1/base-calibrations": Scope.operate,
    "POST /api/v1/base-calibrations/{number}/touches": Scope.operate,
    "POST /api/v1/base-calibrations/{number}/touches/{touch}/void": Scope.operate,
    "POST /api/v1/base-calibrations/{number}/finish": Scope.operate,
    # What a plant relies on afterwards
    "POST /api/v1/cells": Scope.engineer,
    "PATCH /api/v1/cells/{cell}": Scope.engineer,
    "POST /api/v1/cells/{cell}/parameters/{version}/release": Scope.engineer,
    "POST /api/v1/cells/{cell}/parameters/{version}/rollback": Scope.engineer,
    "POST /api/v1/base-transforms/{name}/{version}/release": Scope.engineer,
    "POST /api/v1/base-transforms/{name}/{version}/rollback": Scope.engineer,
    "GET /api/v1/webhooks": Scope.engineer,
    "POST /api/v1/webhooks": Scope.engineer,
    "GET /api/v1/webhooks/{webhook}": Scope.engineer,
    "POST /api/v1/webhooks/{webhook}/remove": Scope.engineer,
    "POST /api/v1/webhooks/{webhook}/test": Scope.engineer,
    "GET /api/v1/webhooks/{webhook}/deliveries": Scope.engineer,
    "GET /access": Scope.engineer,
    "GET /api/v1/users": Scope.engineer,
    "POST /api/v1/users": Scope.engineer,
    "POST /api/v1/users/{name}/link": Scope.engineer,
    "POST /api/v1/users/{name}/disable": Scope.engineer,
    "GET /api/v1/keys": Scope.engineer,
    "POST /api/v1/keys": Scope.engineer,
    "POST /api/v1/keys/{key}/revoke": Scope.engineer,
    "GET /api/v1/audit": Scope.engineer,
}


@dataclass(frozen=True)
class _Line:
    method: str
    path: str
    pattern: re.Pattern[str]
    needed: Scope


def _read(line: str, needed: Scope) -> _Line:
    method, path = line.split(" ")
    return _Line(method, path, compile_path(path)[0], needed)


ASKING = frozenset({"POST /api/v1/cells/{cell}/compensate"})
"""Sent as POST for the size of the question; they change nothing and leave no line in the trail."""

_LINES = tuple(_read(line, needed) for line, needed in WHO_MAY.items())


class Unlisted(LookupError):
    """No line of the table fits; `methods` are those that the path has lines for."""

    def __init__(self, methods: tuple[str, ...]) -> None:
        super().__init__(methods)
        self.methods = methods


def needed_for(method: str, path: str) -> tuple[str, Scope]:
    """Return the line that a request falls under, and its scope; the strictest of several.

    Raises
    ------
    Unlisted
        If there is no line.
    """
    # The application answers an address with a slash too many by naming the right one.
    path = path.rstrip("/") or "/"
    fitting = [line for line in _LINES if line.pattern.match(path)]
    own = [line for line in fitting if line.method == method]
    if not own:
        raise Unlisted(tuple(sorted({line.method for line in fitting})))
    order = list(Scope)
    strictest = max(own, key=lambda line: order.index(line.needed))
    return f"{method} {strictest.path}", strictest.needed

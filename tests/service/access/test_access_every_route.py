"""Every route of the application, without, with too little and with right credentials."""

import httpx
import pytest
from fastapi.routing import iter_route_contexts

from service.access.scopes import WHO_MAY, Scope
from service.main import create_app
from service.settings import Settings

CHANGING = {"POST", "PUT", "PATCH", "DELETE"}
ORDER = list(Scope)


def routes() -> list[tuple[str, str]]:
    """Method and path of each, from the application and not from the table of scopes."""
    return [
        (method, route.path)
        for route in iter_route_contexts(create_app(Settings()).routes)
        for method in sorted(route.methods - {"HEAD", "OPTIONS"})
    ]


ROUTES = routes()
GUARDED = [route for route in ROUTES if WHO_MAY[" ".join(route)] is not Scope.public]


def send(caller: httpx.Client, method: str, path: str, **headers: str) -> httpx.Response:
    """Call a route with a number where it wants something's name or number."""
    for name in [part for part in path.split("/") if part.startswith("{")]:
        path = path.replace(name, "1")
    return caller.request(method, caller.base_url.join(path), headers=headers)


def refused(answer: httpx.Response) -> bool:
    to_login = answer.status_code == 303 and answer.headers["location"].startswith("/login?next=/")
    return answer.status_code in {401, 403} or to_login


def test_the_walk_sees_routes_of_every_kind():
    assert len(ROUTES) > 40
    assert {("POST", "/api/v1/cells/{cell}/arm"), ("GET", "/campaigns/{number}")} <= set(ROUTES)


def test_public_routes_are_those_that_must_work_before_anybody_is_known():
    assert {path for line, path in ROUTES if WHO_MAY[f"{line} {path}"] is Scope.public} == {
        "/healthz",
        "/readyz",
        "/openapi.json",
        "/assets/{collection}/{version}/{file}",
        "/login",
        "/welcome",
        "/api/v1/login",
        "/api/v1/welcome",
    }


def test_nobody_gets_in_anywhere(nobody):
    for method, path in GUARDED:
        answer = send(nobody, method, path)
        assert refused(answer), f"{method} {path}: {answer.status_code}"
        if path.startswith("/api/"):
            assert answer.status_code == 401
            assert answer.headers["www-authenticate"] == "Bearer"


def test_a_wrong_key_gets_in_nowhere(opened):
    stranger = opened(Authorization="Bearer rcal_" + "x" * 43)
    for method, path in GUARDED:
        assert send(stranger, method, path).status_code in {401, 429, 303}, f"{method} {path}"


def test_a_key_opens_what_its_scope_covers_and_nothing_more(program):
    # A key has no password that it could change.
    for scope in ("read", "operate", "engineer"):
        caller = program(scope)
        for method, path in GUARDED:
            needed = WHO_MAY[f"{method} {path}"]
            answer = send(caller, method, path)
            enough = ORDER.index(scope) >= ORDER.index(needed)
            if not enough:
                assert answer.status_code == 403, f"{scope}: {method} {path}: {answer.status_code}"
                assert str(needed) in answer.json()["detail"]
            elif path != "/api/v1/password":
                assert not refused(answer), f"{scope}: {method} {path}: {answer.status_code}"


@pytest.mark.parametrize("role", ["operate", "engineer"])
def test_a_person_changes_something_only_from_the_services_own_pages(person, role):
    browser = person(role=role)
    token = browser.get("me").json()["csrf_token"]
    for method, path in GUARDED:
        if method not in CHANGING:
            assert send(browser, method, path).status_code != 401, path
            continue
        without = send(browser, method, path)
        wrong = send(browser, method, path, **{"X-CSRF-Token": "0" * 64})
        empty = send(browser, method, path, **{"X-CSRF-Token": ""})
        for answer in (without, wrong, empty):
            assert answer.status_code == 403, f"{method} {path}: {answer.status_code}"
        enough = ORDER.index(role) >= ORDER.index(WHO_MAY[f"{method} {path}"])
        if path != "/api/v1/logout":
            right = send(browser, method, path, **{"X-CSRF-Token": token})
            assert (right.status_code == 403) is not enough, f"{method} {path}"
    assert send(browser, "POST", "/api/v1/logout", **{"X-CSRF-Token": token}).status_code == 200
    assert browser.get("me").status_code == 401


def test_what_has_no_line_does_not_exist_even_for_an_engineer(client):
    assert client.get(client.base_url.join("/nothing")).status_code == 404
    answer = client.put("cells/c1")
    assert (answer.status_code, answer.headers["allow"]) == (405, "GET, PATCH")
    assert client.get("cells/../keys").status_code in {200, 404}


def test_a_route_without_a_line_keeps_the_service_from_being_made(monkeypatch):
    monkeypatch.delitem(WHO_MAY, "POST /api/v1/cells/{cell}/arm")
    with pytest.raises(LookupError, match=r"POST /api/v1/cells/\{cell\}/arm"):
        create_app(Settings())

"""Callers of every kind."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack

import httpx
import pytest
from pwdlib import PasswordHash
from pwdlib.hashers.argon2 import Argon2Hasher

from service.access import secrets
from tests.credentials import PASSWORD
from tests.serving import PATIENCE_S

CHEAP = PasswordHash((Argon2Hasher(time_cost=1, memory_cost=8, parallelism=1),))
"""The same algorithm, a thousand times cheaper; `test_access_logins` looks at the real cost."""

Opener = Callable[..., httpx.Client]


@pytest.fixture(autouse=True)
def _cheap_passwords(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(secrets, "_hasher", CHEAP)


@pytest.fixture
def opened(client: httpx.Client) -> Iterator[Opener]:
    """Make another client of the same service."""
    with ExitStack() as stack:

        def make(**headers: str) -> httpx.Client:
            base_url = client.base_url
            return stack.enter_context(
                httpx.Client(base_url=base_url, headers=headers, timeout=PATIENCE_S)
            )

        yield make


@pytest.fixture
def nobody(opened: Opener) -> httpx.Client:
    return opened()


@pytest.fixture
def program(client: httpx.Client, opened: Opener) -> Callable[[str], httpx.Client]:
    """A program with a key of a scope."""

    def make(scope: str) -> httpx.Client:
        made = client.post("keys", json={"name": f"program-{scope}", "scope": scope})
        assert made.status_code == 201, made.text
        return opened(Authorization=f"Bearer {made.json()['key']}")

    return make


@pytest.fixture
def link(client: httpx.Client) -> Callable[..., str]:
    """The token by which a new user chooses a password."""

    def make(name: str = "anna", role: str = "operate") -> str:
        assert client.post("users", json={"name": name, "role": role}).status_code == 201
        return client.post(f"users/{name}/link").json()["path"].partition("token=")[2]

    return make


@pytest.fixture
def person(opened: Opener, link: Callable[..., str]) -> Callable[..., httpx.Client]:
    """A browser in which somebody is logged in; it sends no token of forms by itself."""

    def make(name: str = "anna", role: str = "operate") -> httpx.Client:
        browser = opened()
        token = link(name, role)
        answer = browser.post("welcome", json={"token": token, "password": PASSWORD})
        assert answer.status_code == 200, answer.text
        return browser

    return make

"""People: one-time links, passwords, logins, and what ends them."""

import re
import threading
import time

import pytest
from sqlalchemy import text

from service.access import secrets
from service.access.failures import PER_ADDRESS, Failures, TooMany
from service.db.engine import Database
from tests.credentials import PASSWORD

REAL_HASHER = secrets._hasher
OTHER = "a different sentence altogether"


def csrf(browser) -> dict[str, str]:
    return {"X-CSRF-Token": browser.get("me").json()["csrf_token"]}


def test_a_link_lets_one_person_choose_a_password_once(link, opened):
    token = link("anna")
    browser, late = opened(), opened()
    page = browser.get(browser.base_url.join(f"/welcome?token={token}"))
    assert "For the user “anna”" in page.text
    assert "nothing" not in page.headers["referrer-policy"]
    answer = browser.post("welcome", json={"token": token, "password": PASSWORD})
    assert answer.json()["name"] == "anna"
    assert browser.get("me").json()["scope"] == "operate"
    again = late.post("welcome", json={"token": token, "password": OTHER})
    assert again.status_code == 401
    assert "used" in again.json()["detail"]
    assert "used" in late.get(late.base_url.join(f"/welcome?token={token}")).text
    assert late.post("login", json={"name": "anna", "password": PASSWORD}).status_code == 200


def test_a_link_used_by_many_at_once_serves_one(link, opened):
    token = link("anna")
    answers = []

    def use(password: str) -> None:
        body = {"token": token, "password": password}
        answers.append(opened().post("welcome", json=body).status_code)

    threads = [threading.Thread(target=use, args=(f"{PASSWORD} {n}",)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(answers) == [200, 401, 401, 401]


def test_a_link_ends_by_time_and_by_a_newer_one(link, client, nobody, database: Database):
    first = link("anna")
    second = client.post("users/anna/link").json()["path"].partition("token=")[2]
    body = {"password": PASSWORD}
    assert nobody.post("welcome", json=body | {"token": first}).status_code == 401
    with database.write() as session:
        session.execute(text("UPDATE one_time_link SET expires = '2020-01-01T00:00:00.000+00:00'"))
    assert nobody.post("welcome", json=body | {"token": second}).status_code == 401


@pytest.mark.parametrize("password", ["short", "a" * 40, "anna is my name", "1212121212"])
def test_a_weak_password_is_refused_and_the_link_stays(link, nobody, password):
    token = link("anna")
    weak = nobody.post("welcome", json={"token": token, "password": password})
    assert weak.status_code == 422
    assert weak.json()["detail"].startswith("body password: ")
    assert nobody.post("welcome", json={"token": token, "password": PASSWORD}).is_success


def test_passwords_are_stored_as_argon2id_and_tokens_as_hashes(person, database: Database):
    browser = person("anna")
    (token,) = browser.cookies.values()
    with database.read() as session:
        stored = session.scalar(text("SELECT password_hash FROM person"))
        tables = ("person", "login", "one_time_link", "audit", "answer", "api_key")
        rows = [session.execute(text(f"SELECT * FROM {table}")).all() for table in tables]
    assert stored.startswith("$argon2id$")
    assert PASSWORD not in str(rows)
    assert token not in str(rows)


def test_a_password_costs_what_the_standards_ask_for():
    """OWASP's least for argon2id: 19 MiB, two passes, one lane."""
    cost = re.search(r"\$m=(\d+),t=(\d+),p=(\d+)\$", REAL_HASHER.hash(PASSWORD))
    memory_kib, passes, _ = (int(part) for part in cost.groups())
    assert memory_kib >= 19 * 1024
    assert passes >= 2


def test_the_cookie_is_out_of_reach_of_scripts_and_other_sites(link, nobody):
    answer = nobody.post("welcome", json={"token": link(), "password": PASSWORD})
    cookie = answer.headers["set-cookie"].lower()
    assert "httponly" in cookie
    assert "samesite=lax" in cookie
    # Over plain HTTP on this machine; under TLS it is secure, see test_access_start.
    assert "secure" not in cookie


def test_a_wrong_password_and_an_unknown_name_are_told_alike(person, nobody):
    person("anna")
    wrong = nobody.post("login", json={"name": "anna", "password": "wrong"})
    unknown = nobody.post("login", json={"name": "zoe", "password": "wrong"})
    assert wrong.status_code == unknown.status_code == 401
    assert wrong.json() == unknown.json()


def test_after_ten_wrong_passwords_even_the_right_one_has_to_wait(person, nobody, client):
    person("anna")
    body = {"name": "anna", "password": "wrong"}
    answers = [nobody.post("login", json=body).status_code for _ in range(10)]
    assert answers == [401] * 10
    answer = nobody.post("login", json=body | {"password": PASSWORD})
    assert answer.status_code == 429
    assert 0 < int(answer.headers["retry-after"]) <= 300
    assert re.search(r"try again in \d+ s", answer.json()["detail"])
    # Who has a valid key is not kept waiting by it.
    assert client.get("me").status_code == 200


def test_a_clock_that_is_set_back_makes_nobody_wait_longer(monkeypatch):
    failures = Failures()
    for _ in range(PER_ADDRESS.most):
        failures.attempt("192.0.2.7", "anna")
    yesterday = time.time() - 86_400.0
    monkeypatch.setattr(time, "time", lambda: yesterday)
    with pytest.raises(TooMany) as refusal:
        failures.attempt("192.0.2.7", "anna")
    assert 0 < int(refusal.value.headers["Retry-After"]) <= 300


def test_a_lockout_ends_when_its_first_try_is_old_enough(monkeypatch):
    moment = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: moment[0])
    failures = Failures()
    for second in range(PER_ADDRESS.most):
        moment[0] = float(second)
        failures.wrong_key("192.0.2.7")
    moment[0] = 299.5
    with pytest.raises(TooMany, match="in 1 s"):
        failures.wrong_key("192.0.2.7")
    failures.wrong_key("192.0.2.8")
    moment[0] = 300.0
    failures.wrong_key("192.0.2.7")
    with pytest.raises(TooMany, match="in 1 s"):
        failures.wrong_key("192.0.2.7")


def test_addresses_that_came_long_ago_are_not_kept(monkeypatch):
    moment = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: moment[0])
    failures = Failures()
    for number in range(10_000):
        moment[0] += 10.0
        failures.wrong_key(f"host {number}")
    assert len(failures._tries) < 2000


def test_wrong_keys_are_slowed_down_and_right_ones_are_not(opened, program):
    stranger, known = opened(Authorization="Bearer no-such-key"), program("read")
    answers = [stranger.get("cells").status_code for _ in range(12)]
    assert answers == [401] * 10 + [429] * 2
    assert known.get("cells").status_code == 200


def test_a_right_password_forgets_the_wrong_ones_before(person, nobody):
    person("anna")
    for _ in range(3):
        for _ in range(6):
            nobody.post("login", json={"name": "anna", "password": "wrong"})
        answer = nobody.post("login", json={"name": "anna", "password": PASSWORD})
        assert answer.status_code == 200


def test_a_new_password_ends_all_other_logins(person, opened):
    browser, other = person("anna"), opened()
    other.post("login", json={"name": "anna", "password": PASSWORD})
    assert other.get("me").status_code == 200
    wrong = {"old": "wrong", "new": OTHER}
    assert browser.post("password", json=wrong, headers=csrf(browser)).status_code == 403
    change = {"old": PASSWORD, "new": OTHER}
    assert browser.post("password", json=change, headers=csrf(browser)).status_code == 200
    assert browser.get("me").json()["name"] == "anna"
    assert other.get("me").status_code == 401
    assert other.post("login", json={"name": "anna", "password": PASSWORD}).status_code == 401
    assert other.post("login", json={"name": "anna", "password": OTHER}).status_code == 200


def test_who_is_disabled_is_out_at_once_until_a_new_link(person, client, opened):
    browser = person("anna")
    assert client.post("users/anna/disable").json()["disabled"] is True
    assert browser.get("me").status_code == 401
    assert browser.post("login", json={"name": "anna", "password": PASSWORD}).status_code == 401
    token = client.post("users/anna/link").json()["path"].partition("token=")[2]
    assert opened().post("welcome", json={"token": token, "password": OTHER}).is_success


def test_the_last_engineer_who_can_log_in_stays(person, client, link):
    person("anna", "engineer")
    link("ben", "engineer")
    refused = client.post("users/anna/disable")
    assert refused.status_code == 409
    assert "only engineer" in refused.json()["detail"]
    assert client.post("users/ben/disable").status_code == 200


def test_a_login_ends_with_its_time(person, database: Database):
    browser = person("anna")
    with database.write() as session:
        session.execute(text("UPDATE login SET expires = '2020-01-01T00:00:00.000+00:00'"))
    assert browser.get("me").status_code == 401


def test_a_page_leads_to_the_login_and_back_to_this_service_only(nobody):
    root = nobody.base_url
    answer = nobody.get(root.join("/campaigns?before=7"))
    assert (answer.status_code, answer.headers["location"]) == (
        303,
        "/login?next=/campaigns%3Fbefore%3D7",
    )
    for wanted, shown in (
        ("/campaigns%3Fbefore%3D7", "/campaigns?before=7"),
        ("//evil.example", "/"),
        ("/%5Cevil.example", "/"),
        ("https://evil.example", "/"),
        ("/%0D%0Aevil", "/"),
    ):
        page = nobody.get(root.join(f"/login?next={wanted}")).text
        assert f'data-next="{shown}"' in page


def test_an_operator_cannot_make_users_or_keys(person):
    browser = person("anna", "operate")
    for path in ("users", "keys", "audit"):
        assert browser.get(path).status_code == 403
    for path in ("users", "keys", "users/anna/link"):
        assert browser.post(path, json={}, headers=csrf(browser)).status_code == 403

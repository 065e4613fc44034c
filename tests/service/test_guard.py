"""What comes through a browser from elsewhere changes nothing, and foreign names get no answer."""

import http.client

import httpx
import pytest

from service.settings import Settings


@pytest.fixture
def settings(database_url: str) -> Settings:
    return Settings(database_url=database_url, hosts=("cal.plant",))


@pytest.fixture
def own(client: httpx.Client) -> str:
    """Host and port of the service."""
    return f"{client.base_url.host}:{client.base_url.port}"


def described(name: str) -> dict:
    device = {"driver": "mock", "address": "127.0.0.1:9"}
    return {"name": name, "robot": {"model": "ur10e", **device}, "tracker": device}


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "https://evil.example"},
        {"Origin": "http://127.0.0.1:1"},
        {"Origin": "null"},
        {"Sec-Fetch-Site": "cross-site"},
    ],
)
def test_a_page_of_another_site_can_change_nothing(client, cell, headers):
    for path in ("cells", "cells/c1/disarm", "campaigns/import"):
        answer = client.post(path, headers=headers, json={})
        assert answer.status_code == 403
        assert answer.headers["content-type"] == "application/problem+json"
        assert "another site" in answer.json()["detail"]
    assert client.get("cells/c1").json()["armed"] is True
    # A link from elsewhere still leads here.
    assert client.get("cells", headers=headers).status_code == 200


def test_the_services_own_pages_and_plain_programs_may(client, own):
    origin = {"Origin": f"http://{own}", "Sec-Fetch-Site": "same-origin"}
    assert client.post("cells", json=described("c1"), headers=origin).status_code == 201
    assert client.post("cells", json=described("c2")).status_code == 201


@pytest.mark.parametrize(
    "host",
    ["evil.example", "127.0.0.1.evil.example:80", "192.0.2.1", "[::2]"],
)
def test_a_foreign_name_that_leads_here_gets_no_answer(client, host):
    for path in ("cells", client.base_url.join("/"), client.base_url.join("/healthz")):
        answer = client.get(path, headers={"Host": host})
        assert answer.status_code == 421
        assert f"not '{host}'" in answer.json()["detail"]


@pytest.mark.parametrize(
    "host", ["localhost:8300", "LocalHost", "127.0.0.1", "127.1.2.3:1", "[::1]:80", "Cal.plant:443"]
)
def test_the_machines_own_names_and_the_configured_one_are_answered(client, host):
    assert client.get("cells", headers={"Host": host}).status_code == 200


def test_a_page_behind_a_proxy_with_tls_may_change_something(client):
    headers = {"Host": "cal.plant", "Origin": "https://cal.plant"}
    assert client.post("cells", json=described("c1"), headers=headers).status_code == 201


def test_a_request_without_a_host_gets_no_answer(client):
    plain = http.client.HTTPConnection(client.base_url.host, client.base_url.port, timeout=5)
    plain._http_vsn, plain._http_vsn_str = 10, "HTTP/1.0"
    plain.putrequest("GET", "/healthz", skip_host=True)
    plain.endheaders()
    assert plain.getresponse().status == 421
    plain.close()

"""The service as a process: the first link, TLS, and nothing secret in what it prints."""

import json
import os
import re
import signal
import ssl
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import httpx
import pytest

from tests.credentials import KEY, PASSWORD

ROOT = Path(__file__).parents[3]
SERVE = "from service.cli import main; main()"


class Served:
    """`robocal serve` without a worker, and what it printed."""

    def __init__(self, folder: Path, **settings: str) -> None:
        self.log = folder / "log"
        names = {f"ROBOCAL_{name.upper()}": value for name, value in settings.items()}
        with self.log.open("a") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-c", SERVE, "serve", "--port", "0", "--no-worker"],
                env=os.environ | names,
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
                cwd=ROOT,
            )
        line = self.process.stdout.readline()
        assert line, self.log.read_text()
        self.url = json.loads(line)["url"]

    def links(self) -> list[str]:
        return re.findall(r"open (\S+/welcome\?token=\S+) within", self.log.read_text())

    def end(self) -> None:
        self.process.send_signal(signal.SIGINT)
        self.process.wait(20)
        self.process.stdout.close()


@pytest.fixture
def serve(database_url: str, tmp_path: Path) -> Iterator[Callable[..., Served]]:
    started: list[Served] = []

    def start(**settings: str) -> Served:
        started.append(Served(tmp_path, database_url=database_url, **settings))
        return started[-1]

    yield start
    for one in started:
        if one.process.poll() is None:
            one.end()


def test_the_first_start_prints_a_link_by_which_one_engineer_is_made(serve):
    first = serve()
    (old,) = first.links()
    assert old.startswith(first.url)
    first.end()
    again = serve()
    link = again.links()[-1]
    assert link.partition("token=")[2] != old.partition("token=")[2]
    with httpx.Client(base_url=again.url) as browser:
        page = browser.get("/login")
        assert "printed a one-time link" in page.text
        body = {"token": old.partition("token=")[2], "name": "eva", "password": PASSWORD}
        assert browser.post("/api/v1/welcome", json=body).status_code == 401
        body["token"] = link.partition("token=")[2]
        made = browser.post("/api/v1/welcome", json=body)
        assert made.json()["scope"] == "engineer"
        token = {"X-CSRF-Token": made.json()["csrf_token"]}
        user = {"name": "otto", "role": "operate"}
        assert browser.post("/api/v1/users", json=user, headers=token).status_code == 201
        wrong = {"name": "eva", "password": "not-her-word"}
        browser.post("/api/v1/login", json=wrong)
        cookie = browser.cookies["robocal_login"]
    again.end()
    third = serve()
    third.end()
    said = third.log.read_text()
    assert len(third.links()) == 2, "once somebody can log in, no start prints a link"
    for secret in (PASSWORD, "not-her-word", cookie, KEY, made.json()["csrf_token"]):
        assert secret not in said


@pytest.fixture
def certificate(tmp_path: Path) -> dict[str, str]:
    """A certificate for this machine, made for the test."""
    cert, key = tmp_path / "cert.pem", tmp_path / "key.pem"
    subject = ["-subj", "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1"]
    made = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", *subject]
    subprocess.run([*made, "-keyout", str(key), "-out", str(cert)], check=True, capture_output=True)
    return {"tls_cert": str(cert), "tls_key": str(key)}


def test_under_tls_cookies_are_secure_and_browsers_are_told_to_stay(serve, certificate):
    served = serve(**certificate)
    assert served.url.startswith("https://127.0.0.1:")
    trust = ssl.create_default_context(cafile=certificate["tls_cert"])
    with httpx.Client(base_url=served.url, verify=trust) as browser:
        page = browser.get("/login")
        assert int(page.headers["strict-transport-security"].partition("=")[2]) > 10**7
        token = served.links()[0].partition("token=")[2]
        body = {"token": token, "name": "eva", "password": PASSWORD}
        answer = browser.post("/api/v1/welcome", json=body)
        assert "Secure" in answer.headers["set-cookie"]
        assert browser.get("/api/v1/me").json()["name"] == "eva"


def test_an_unguarded_address_is_refused_in_one_line(database_url):
    for settings, words in (
        ({"ROBOCAL_HOST": "0.0.0.0"}, "plain text"),
        ({"ROBOCAL_ACCESS": "open", "ROBOCAL_HOSTS": '["cal.plant"]'}, "this machine alone"),
    ):
        done = subprocess.run(
            [sys.executable, "-c", SERVE, "serve", "--port", "0", "--no-worker"],
            env=os.environ | settings | {"ROBOCAL_DATABASE_URL": database_url},
            capture_output=True,
            text=True,
            cwd=ROOT,
            timeout=60,
        )
        assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
        assert done.stderr.startswith("robocal: setting: ")
        assert words in done.stderr


def test_open_access_says_so_on_each_page_and_lets_everybody_work(serve):
    served = serve(access="open")
    assert served.links() == []
    with httpx.Client(base_url=served.url) as anybody:
        for path in ("/", "/campaigns", "/access"):
            assert "Access is open" in anybody.get(path).text
        assert anybody.get("/api/v1/me").json()["kind"] == "anyone"
        wrong = {"Origin": "https://evil.example"}
        assert anybody.post("/api/v1/keys", json={}, headers=wrong).status_code == 403
        made = anybody.post("/api/v1/keys", json={"name": "k", "scope": "read"})
        assert made.status_code == 201

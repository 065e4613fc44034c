"""A world, the service and workers as processes, for the tests that go through HTTP."""

import json
import os
import signal
import socket
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path

import httpx
import psycopg

from tests.credentials import BEARER, PASSWORD
from tests.postgresql import plain

ROOT = Path(__file__).parents[2]
ROBOT = ROOT / "robocal" / "robots" / "ur10e.yaml"
START_DEG = [0, -90, 90, -90, -90, 0]
ENDED = {"finished", "aborted", "failed"}
PATIENCE_S = 240.0
"""For what is not promised in a time, on a machine that does ten other things."""


def wait_until(
    condition: Callable[[], bool], within_s: float = PATIENCE_S, period_s: float = 0.01
) -> None:
    """Wait for an event."""
    deadline = time.monotonic() + within_s
    while not condition():
        assert time.monotonic() < deadline, f"did not happen within {within_s} s"
        time.sleep(period_s)


def _without_bytecode_switch() -> dict[str, str]:
    """Let started programs keep compiled modules: twenty restarts are twenty seconds shorter."""
    return {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}


class Process:
    """A program that says in one line of JSON that it is ready."""

    def __init__(self, *command: str, environment: dict[str, str]) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", *command],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            cwd=ROOT,
            env=_without_bytecode_switch() | environment,
        )
        line = self.process.stdout.readline()
        assert line, f"{command} ended with status {self._collect()}"
        self.ready = json.loads(line)

    def kill(self) -> None:
        self.process.kill()
        self._collect()

    def end(self, within_s: float = PATIENCE_S) -> int:
        self.process.send_signal(signal.SIGTERM)
        return self._collect(within_s)

    def signal(self, number: int) -> None:
        self.process.send_signal(number)

    def _collect(self, within_s: float = PATIENCE_S) -> int:
        try:
            return self.process.wait(within_s)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise
        finally:
            self.process.stdin.close()
            self.process.stdout.close()

    @property
    def alive(self) -> bool:
        return self.process.poll() is None


class World:
    """The emulated cell's process and a client of it."""

    def __init__(self, folder: Path, **config: object) -> None:
        path = folder / "world.json"
        defaults = {"robot": str(ROBOT), "seed": 3, "time_scale": 60}
        path.write_text(json.dumps(defaults | {"start_joints_deg": START_DEG} | config))
        self._process = Process("drivers.emulators.world", "--config", str(path), environment={})
        self.address = f"127.0.0.1:{self._process.ready['port']}"
        self._socket = socket.create_connection(
            ("127.0.0.1", self._process.ready["port"]), timeout=60
        )
        self._lines = self._socket.makefile("rw")

    def ask(self, operation: str, **arguments: object) -> dict:
        self._lines.write(json.dumps({"op": operation, **arguments}) + "\n")
        self._lines.flush()
        reply = json.loads(self._lines.readline())
        assert reply["ok"], reply
        return reply

    def close(self) -> None:
        self._lines.close()
        self._socket.close()
        self._process.process.stdin.close()
        assert self._process.process.wait(PATIENCE_S) == 0
        self._process.process.stdout.close()


class Site:
    """One installation: a database, the service, workers, and an HTTP client that says where."""

    def __init__(self, folder: Path, **settings: object) -> None:
        self.database = folder / "robocal.sqlite3"
        self._environment = {
            "ROBOCAL_DATABASE_URL": f"sqlite:///{self.database}",
            # A busy machine may stop a worker for a second; who waits for a lease to end says so.
            "ROBOCAL_LEASE_S": "5.0",
            "ROBOCAL_IDLE_S": "0.05",
            "ROBOCAL_PORT": "0",
            "ROBOCAL_EVENTS_POLL_S": "0.02",
            **{f"ROBOCAL_{name.upper()}": str(value) for name, value in settings.items()},
        }
        self.database_url = self._environment["ROBOCAL_DATABASE_URL"]
        self._processes: list[Process] = []
        self.service: Process | None = None
        self._people: set[str] = set()
        self.client = httpx.Client(timeout=60, headers=BEARER)
        self.start_service()

    def start_service(self) -> None:
        self.service = self._start("service.main")
        self.client.base_url = self.service.ready["url"] + "/api/v1"

    def login_cookie(self, name: str = "anna", role: str = "engineer") -> dict[str, str]:
        """Log a person in, made where there is none, and return the browser's cookie."""
        if name not in self._people:
            self._people.add(name)
            assert self.post("/users", {"name": name, "role": role}).status_code == 201
            token = self.post(f"/users/{name}/link").json()["path"].partition("token=")[2]
            chosen = {"token": token, "password": PASSWORD}
            assert self.post("/welcome", chosen).status_code == 200
        with httpx.Client(base_url=self.client.base_url) as browser:
            assert browser.post("/login", json={"name": name, "password": PASSWORD}).is_success
            ((cookie, token),) = browser.cookies.items()
        return {"name": cookie, "value": token, "url": self.service.ready["url"]}

    def start_worker(self) -> Process:
        return self._start("service.jobs.worker")

    def _start(self, *command: str) -> Process:
        process = Process(*command, environment=self._environment)
        self._processes.append(process)
        return process

    def get(self, path: str, **options: object) -> httpx.Response:
        return self.client.get(path, **options)

    def post(self, path: str, body: object = None, **options: object) -> httpx.Response:
        return self.client.post(path, json=body, **options)

    def make_cell(self, world: World, name: str = "c1", *, armed: bool = True) -> None:
        cell = {
            "name": name,
            "robot": {"model": "ur10e", "driver": "mock", "address": world.address},
            "tracker": {"driver": "mock", "address": world.address},
        }
        assert self.post("/cells", cell).status_code == 201
        if armed:
            assert self.post(f"/cells/{name}/arm").status_code == 200

    def start_campaign(self, poses: object, cell: str = "c1", **more: object) -> int:
        body = {"cell": cell, "kind": "calibrate", "poses": poses, "settle_s": 0.2} | more
        answer = self.post("/campaigns", body)
        assert answer.status_code == 202, answer.text
        return answer.json()["id"]

    def campaign(self, number: int) -> dict:
        return self.get(f"/campaigns/{number}").json()

    def await_state(self, number: int, *states: str, within_s: float = PATIENCE_S) -> dict:
        wait_until(lambda: self.campaign(number)["state"] in states, within_s, 0.05)
        return self.campaign(number)

    def await_done(self, number: int, done: int, within_s: float = PATIENCE_S) -> None:
        def enough() -> bool:
            shown = self.campaign(number)
            assert shown["state"] != "paused", shown["reason"]
            return shown["done"] >= done

        wait_until(enough, within_s)

    def rows(self, query: str) -> list[tuple]:
        """Look into the database past the service."""
        if self.database_url.startswith("sqlite"):
            with closing(sqlite3.connect(self.database)) as connection:
                return connection.execute(query).fetchall()
        with psycopg.connect(plain(self.database_url)) as server:
            return server.execute(query).fetchall()

    def close(self) -> None:
        self.client.close()
        for process in self._processes:
            process.signal(signal.SIGCONT)
            process.end()


@contextmanager
def installation(folder: Path, *, workers: int = 1, **settings: object) -> Iterator[Site]:
    """A service with workers that ends with the block."""
    with ExitStack() as stack:
        site = Site(folder, **settings)
        stack.callback(site.close)
        for _ in range(workers):
            site.start_worker()
        yield site


@contextmanager
def emulated_world(folder: Path, **config: object) -> Iterator[World]:
    """A world that ends with the block."""
    with closing(World(folder, **config)) as world:
        yield world


def poses_about_start(count: int) -> list[dict[str, float]]:
    """Poses that differ from each other in every joint, near the start."""
    return [
        {
            f"j{joint + 1}_deg": START_DEG[joint] + 10.0 * ((7 * pose * (joint + 3)) % 11) / 11 - 5
            for joint in range(6)
        }
        for pose in range(count)
    ]

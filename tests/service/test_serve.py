"""`robocal serve` as a process: what keeps it going and what it says when it cannot start."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from robocal.errors import BadInput
from service.settings import Settings
from service.start_up import prepare_database

ENTRY = [sys.executable, "-c", "from service.cli import main; main()", "serve", "--port", "0"]
ROOT = Path(__file__).parents[2]
DEADLINE_S = 30.0


@pytest.fixture
def served(database_url: str, tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    with (tmp_path / "log").open("w") as log:
        process = subprocess.Popen(
            ENTRY,
            env=os.environ | {"ROBOCAL_DATABASE_URL": database_url},
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
            cwd=ROOT,
        )
    with process:
        assert process.stdout is not None
        assert json.loads(process.stdout.readline())["ready"] is True
        yield process
        process.send_signal(signal.SIGINT)


def test_a_worker_that_dies_is_replaced_and_none_outlives_the_service(served, tmp_path):
    first = _awaited(lambda: _workers(served.pid))
    os.kill(first[0], signal.SIGKILL)
    second = _awaited(lambda: [pid for pid in _workers(served.pid) if pid not in first])
    assert len(second) == 1
    log = (tmp_path / "log").read_text()
    assert log.count("service.jobs.worker ended with status -9; starting it again") == 1
    served.terminate()
    assert served.wait(DEADLINE_S) == -signal.SIGTERM
    with pytest.raises(ProcessLookupError):
        os.kill(second[0], 0)


def test_a_database_that_cannot_be_used_is_said_in_one_sentence(tmp_path):
    (tmp_path / "var").touch()
    (tmp_path / "text").write_text("no database at all, " * 100)
    for url, words in (
        (f"sqlite:///{tmp_path}/var/robocal.sqlite3", "var' cannot be made"),
        (f"sqlite:///{tmp_path}/text", "file is not a database"),
        (f"sqlite:///{tmp_path}", "unable to open database file"),
        ("foo", "this is no address"),
        ("foo://user:secret@host/x", "this is no address"),
    ):
        with pytest.raises(BadInput) as refused:
            prepare_database(Settings(database_url=url))
        said = str(refused.value)
        assert said.startswith("setting database_url: ")
        assert words in said
        assert "\n" not in said
        assert "secret" not in said


def test_a_file_in_place_of_the_folder_is_one_line_and_status_2(tmp_path):
    (tmp_path / "var").touch()
    status, said = _refused(database_url=f"sqlite:///{tmp_path}/var/robocal.sqlite3")
    assert (status, said.count("\n")) == (2, 1), said
    assert said.startswith("robocal: setting database_url: the folder")


def test_a_port_in_use_is_one_line_and_status_2(database_url):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        status, said = _refused("--port", str(port), database_url=database_url)
    assert (status, said.count("\n")) == (2, 1), said
    assert said.startswith(f"robocal: setting port: 127.0.0.1:{port} cannot be listened on")


def _refused(*arguments: str, database_url: str) -> tuple[int, str]:
    done = subprocess.run(
        [*ENTRY, *arguments],
        env=os.environ | {"ROBOCAL_DATABASE_URL": database_url},
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=DEADLINE_S,
    )
    assert done.stdout == ""
    return done.returncode, done.stderr


def _workers(parent: int) -> list[int]:
    """The workers that a process has started, as the kernel lists them."""
    listed = subprocess.run(
        ["ps", "-o", "pid=,args=", "--ppid", str(parent)], capture_output=True, text=True
    ).stdout
    return [int(line.split()[0]) for line in listed.splitlines() if "service.jobs.worker" in line]


def _awaited(look: Callable[[], list[int]]) -> list[int]:
    deadline = time.monotonic() + DEADLINE_S
    while not (found := look()):
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.05)
    return found

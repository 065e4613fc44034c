"""The user guide: every command of every page is run, and prints what stands below it.

The pages are one session, as their reader has it: one shell, one folder, emulated hardware. Only
what a machine is to them is replaced: the service's port and the PostgreSQL server.
"""

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.credentials import SETTING
from tests.postgresql import address, new_database

ROOT = Path(__file__).parents[2]
GUIDE = ROOT / "docs" / "guide"
PAGES = sorted(path.name for path in GUIDE.glob("[0-9]*.md"))
ENTRY = "from service.cli import main; main()"
LONGEST_S = 600
PORT, SERVER = "127.0.0.1:8300", "postgresql+psycopg://robocal:PASSWORD@database/robocal"
MARK = "=====end of block"
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")
ALIKE = 0.5
"""Decimals may be off by this share: machines time and round differently, noise is drawn anew"""

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="the emulated cell needs Linux"),
    pytest.mark.skipif(
        not all(map(shutil.which, ("bash", "curl", "jq"))), reason="apt-get install curl jq"
    ),
]


@dataclass(frozen=True)
class Block:
    """Commands of a page, and the lines that it promises of them."""

    page: str
    commands: str
    promised: tuple[str, ...]


def blocks_of(page: str) -> list[Block]:
    text = (GUIDE / page).read_text(encoding="utf-8")
    found = re.findall(r"^```sh\n(.*?)^```\n(?:```text\n(.*?)^```\n)?", text, re.M | re.S)
    return [Block(page, commands, tuple(lines.splitlines())) for commands, lines in found]


BLOCKS = [block for page in PAGES for block in blocks_of(page)]


def is_as_promised(promised: str, printed: str) -> bool:
    """Words and whole numbers exactly, decimals about; `…` is anything."""
    pattern, at = "", 0
    for number in NUMBER.finditer(promised):
        pattern += re.escape(promised[at : number.start()])
        whole = number[0].lstrip("-").isdigit()
        pattern += re.escape(number[0]) if whole else rf"({NUMBER.pattern})"
        at = number.end()
    pattern += re.escape(promised[at:])
    fits = re.fullmatch(pattern.replace("…", ".*"), printed.strip("\r"))
    if fits is None:
        return False
    wanted = [float(n[0]) for n in NUMBER.finditer(promised) if not n[0].lstrip("-").isdigit()]
    got = [float(n) for n in fits.groups()]
    return all(abs(g - w) <= ALIKE * abs(w) for g, w in zip(got, wanted, strict=True))


@dataclass(frozen=True)
class Session:
    """What the whole guide printed, block by block, and how it ended."""

    printed: list[str]
    status: int
    last_words: str


@pytest.fixture(scope="module")
def session(tmp_path_factory, postgresql_server):
    with new_database(postgresql_server) as name:
        yield run(tmp_path_factory.mktemp("guide"), address(postgresql_server, name))


def run(folder: Path, database: str) -> Session:
    """Run all pages in one bash; nothing that they start outlives it."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    programs = folder / "programs"
    programs.mkdir()
    command = programs / "robocal"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -c "{ENTRY}" "$@"\n')
    command.chmod(0o755)
    script = "set -euo pipefail\n" + "".join(f"{block.commands}echo '{MARK}'\n" for block in BLOCKS)
    script = script.replace(PORT, f"127.0.0.1:{port}").replace(SERVER, database)
    (folder / "guide.sh").write_text(script)
    environment = {k: v for k, v in os.environ.items() if k != SETTING} | {
        "PATH": f"{programs}:{Path(sys.executable).parent}:{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
        "ROBOCAL_PORT": str(port),
    }
    with (folder / "errors.txt").open("w+") as errors, (folder / "printed.txt").open("w+") as out:
        process = subprocess.Popen(
            ["bash", "guide.sh"],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=errors,
            start_new_session=True,
        )
        try:
            status = process.wait(LONGEST_S)
        except subprocess.TimeoutExpired:
            status = -1
        finally:
            end_group(process)
        out.seek(0)
        errors.seek(0)
        return Session(out.read().split(MARK + "\n"), status, errors.read()[-3000:])


def end_group(process: subprocess.Popen) -> None:
    """End what a failed block left running; after a whole guide there is nothing."""
    try:
        os.killpg(process.pid, signal.SIGTERM)
    except ProcessLookupError:
        return
    process.wait(30)


def test_the_guide_has_its_pages_and_its_table_of_contents_names_them():
    assert len(PAGES) >= 7
    contents = (GUIDE / "README.md").read_text(encoding="utf-8")
    assert re.findall(r"\]\((\d\w+\.md)\)", contents) == PAGES
    assert all(blocks_of(page) for page in PAGES)


def test_every_command_of_the_guide_succeeds(session):
    reached = len(session.printed) - 1
    stopped_at = BLOCKS[reached] if reached < len(BLOCKS) else None
    assert (session.status, stopped_at) == (0, None), (
        session.printed[-1][-2000:] + session.last_words
    )


@pytest.mark.parametrize("page", PAGES)
def test_a_page_keeps_what_it_promises(page, session):
    for block, printed in zip(BLOCKS, session.printed, strict=False):
        if block.page != page:
            continue
        lines = iter(printed.splitlines())
        for promised in block.promised:
            assert any(is_as_promised(promised, line) for line in lines), (
                f"'{promised}' is not in what was printed:\n{printed}"
            )


def test_links_of_the_guide_lead_somewhere():
    for page in GUIDE.glob("*.md"):
        for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_a_promise_is_strict_about_words_and_counts_and_lenient_about_decimals():
    assert is_as_promised("error 0.13 mm of 30", "error 0.1512 mm of 30")
    assert not is_as_promised("error 0.13 mm of 30", "error 0.31 mm of 30")
    assert not is_as_promised("error 0.13 mm of 30", "error 0.13 mm of 31")
    assert is_as_promised("x … z", "x 1 2 z")
    assert not is_as_promised("x", "xy")

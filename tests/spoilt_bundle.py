"""Ways to spoil one file of a bundle, and what its refusal must look like."""

import re
import time
from collections.abc import Callable
from pathlib import Path

import pytest

PATIENCE = 20.0
"""Longest that a refusal may take on a slow machine [s]"""


def edit(file: str, change: Callable[[str], str]) -> Callable[[Path], None]:
    """A way to spoil one file."""

    def spoil(folder: Path) -> None:
        path = folder / file
        before = path.read_text()
        after = change(before)
        assert after != before
        path.write_text(after)

    return spoil


def replaced(file: str, old: str, new: str) -> Callable[[Path], None]:
    return edit(file, lambda text: text.replace(old, new, 1))


def cell(line: int, column: int, value: str) -> Callable[[Path], None]:
    """Put `value` into one cell of measurements.csv; lines count from 1, columns from 0."""

    def change(text: str) -> str:
        lines = [row.split(",") for row in text.splitlines()]
        lines[line - 1][column] = value
        return "\n".join(map(",".join, lines)) + "\n"

    return edit("measurements.csv", change)


def column(name: str, values: Callable[[int], str]) -> Callable[[Path], None]:
    """Add a column to measurements.csv."""

    def change(text: str) -> str:
        header, *rows = text.splitlines()
        wider = [f"{row},{values(index)}" for index, row in enumerate(rows)]
        return "\n".join([f"{header},{name}", *wider]) + "\n"

    return edit("measurements.csv", change)


def keep(rows: int) -> Callable[[Path], None]:
    return edit("measurements.csv", lambda text: "\n".join(text.splitlines()[: rows + 1]) + "\n")


def content(file: str, text: str | bytes) -> Callable[[Path], None]:
    raw = text if isinstance(text, bytes) else text.encode()
    return lambda folder: (folder / file).write_bytes(raw) and None


def campaign(extra: str) -> Callable[[Path], None]:
    return edit("campaign.yaml", lambda text: f"{text}{extra}\n")


def robot(old: str, new: str) -> Callable[[Path], None]:
    return replaced("robot.yaml", old, new)


def parametrised(cases: dict) -> pytest.MarkDecorator:
    return pytest.mark.parametrize(("spoil", "complaint"), cases.values(), ids=cases)


def assert_refused(call, folder: Path, out: Path, complaint: str) -> None:
    before = time.monotonic()
    status, printed, said = call("identify", folder, "--out", out, "--json")
    assert time.monotonic() - before < PATIENCE
    assert re.search(complaint, said), said
    assert said.startswith("robocal: ")
    assert said.count("\n") == 1
    assert len(said) < 400
    assert (status, printed) == (2, "")
    assert not out.exists()

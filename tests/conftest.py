"""What tests of several folders share. Loading it makes the checkout importable as well."""

import gc
import os
import shutil
import signal
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from service.cli import main
from tests.credentials import KEY, SETTING
from tests.measured_cell import true_cell, write_bundle

pytest_plugins = ["tests.postgresql"]

os.environ[SETTING] = KEY

# A suite that a script started in the background hears no Ctrl-C, nor would what its tests start.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="module", autouse=True)
def _what_is_loaded_is_not_looked_through_again() -> None:
    """A look for garbage takes a second after a thousand tests; an arm has a watchdog of 0.15 s."""
    gc.collect()
    gc.freeze()


@pytest.fixture
def call(capsys, monkeypatch) -> Callable[..., tuple[int, str, str]]:
    """The command line in this process: exit status, output, complaint."""

    def command(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["robocal", *map(str, arguments)])
        with pytest.raises(SystemExit) as left:
            main()
        printed = capsys.readouterr()
        return int(left.value.code or 0), printed.out, printed.err

    return command


@pytest.fixture(scope="session")
def sound_bundle(tmp_path_factory) -> Path:
    """48 full poses of a UR5e, 36 of them to fit; not to be changed."""
    folder = tmp_path_factory.mktemp("sound_bundle")
    write_bundle(folder, "ur5e", true_cell("ur5e", 1), rows=48)
    return folder


@pytest.fixture
def bundle(sound_bundle, tmp_path) -> Path:
    """A copy of it that a test may spoil."""
    return Path(shutil.copytree(sound_bundle, tmp_path / "bundle"))

"""Completion by the shells, and how long a shell or a person waits for the words."""

import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ENTRY = "from service.cli import main; main()"
HELP_S = 0.6


def robocal(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", ENTRY, *arguments],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env=os.environ | environment,
        timeout=60,
        check=False,
    )


def completed(shell: str, line: str) -> list[str]:
    """What the program answers to a shell that completes the last word of a line."""
    words = line.split(" ")
    asked = {
        "bash": {"COMP_WORDS": line, "COMP_CWORD": str(len(words) - 1)},
        "zsh": {"_TYPER_COMPLETE_ARGS": line},
        "fish": {"_TYPER_COMPLETE_ARGS": line, "_TYPER_COMPLETE_FISH_ACTION": "get-args"},
    }
    done = robocal(_ROBOCAL_COMPLETE=f"complete_{shell}", **asked[shell])
    assert done.stderr == ""
    return done.stdout.splitlines()


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_commands_are_completed(shell):
    found = " ".join(completed(shell, "robocal un"))
    assert "uncertainty" in found
    assert "identify" not in found


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_options_are_completed(shell):
    found = " ".join(completed(shell, "robocal identify --str"))
    assert "--strategy" in found
    assert "--out" not in found


def test_robots_are_completed():
    assert completed("bash", "robocal plan ur10") == ["ur10", "ur10e"]


@pytest.mark.parametrize(
    ("shell", "words"),
    [
        ("bash", "complete -o default -F _robocal_completion robocal"),
        ("zsh", "compdef _robocal_completion robocal"),
        ("fish", "complete --command robocal"),
    ],
)
def test_each_shell_gets_its_script(shell, words):
    script = robocal(_ROBOCAL_COMPLETE=f"source_{shell}").stdout
    assert words in script
    assert "_ROBOCAL_COMPLETE=complete_" in script


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_a_real_bash_completes_with_the_script(tmp_path):
    command = tmp_path / "robocal"
    command.write_text(f'#!/bin/sh\nexec {sys.executable} -c "{ENTRY}" "$@"\n')
    command.chmod(0o755)
    script = (
        'eval "$(_ROBOCAL_COMPLETE=source_bash robocal)"\n'
        "COMP_WORDS=(robocal ide) COMP_CWORD=1\n"
        '_robocal_completion robocal; echo "${COMPREPLY[@]}"\n'
    )
    done = subprocess.run(
        ["bash", "-c", script],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env=os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}"},
        timeout=60,
        check=True,
    )
    assert done.stdout.split() == ["identify"]


def test_help_comes_at_once():
    """Processor time, so that a busy machine does not count; the least of three."""

    def spent() -> float:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        assert robocal("--help").returncode == 0
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    assert min(spent() for _ in range(3)) < HELP_S

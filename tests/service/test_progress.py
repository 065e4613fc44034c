"""The bar of long work, at a terminal alone; and a stop that leaves nothing half-written."""

import json
import signal

import pytest
from terminal import AtTerminal

from robocal.formats.whole_file import write_together
from robocal.progress import counted, tell, watched_by
from tests.measured_cell import true_cell, write_bundle


def test_a_watcher_hears_every_step_and_nobody_hears_afterwards():
    heard = []
    with watched_by(lambda *told: heard.append(told)):
        assert list(counted("fits", "ab", 2)) == ["a", "b"]
        tell("the rest")
    tell("unheard")
    assert heard == [("fits", 0, 2), ("fits", 1, 2), ("fits", 2, 2), ("the rest", 0, None)]


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    folder = tmp_path_factory.mktemp("small")
    write_bundle(folder, "ur5e", true_cell("ur5e", 1), rows=24)
    return folder


def long_work(bundle, out, *more):
    """A million simulated campaigns: hours."""
    return ("uncertainty", bundle, "--out", out, "--refits", 1_000_000, *more)


COMMANDS = {
    "identify": ("fitting the geometry", lambda bundle: ("identify", bundle)),
    "uncertainty": (
        "simulated campaigns, fitted",
        lambda bundle: ("uncertainty", bundle, "--refits", 20, "--draws", 1000),
    ),
    "diagnose": ("what noise alone would show", lambda bundle: ("diagnose", bundle)),
    "plan": (
        "index of random sets",
        lambda bundle: ("plan", "ur10e", "--count", 20, "--candidates", 60),
    ),
}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_person_sees_the_work_and_a_pipe_gets_the_result_alone(command, small, tmp_path):
    words, arguments = COMMANDS[command]
    run = AtTerminal(*arguments(small), "--out", tmp_path / "out")
    status, printed = run.end()
    assert status == 0, run.seen
    assert words in run.seen
    assert words not in printed
    assert "\x1b" not in printed
    assert printed.strip()


def test_whoever_asks_for_json_gets_no_bar(small, tmp_path):
    run = AtTerminal("identify", small, "--out", tmp_path, "--json")
    status, printed = run.end()
    assert (status, run.seen) == (0, "")
    json.loads(printed)


def test_stopped_in_the_middle_a_command_leaves_no_file_and_no_traceback(small, tmp_path):
    out = tmp_path / "out"
    run = AtTerminal(*long_work(small, out))
    run.until_seen("simulated campaigns, fitted")
    run.process.send_signal(signal.SIGINT)
    status, printed = run.end()
    assert status == 128 + signal.SIGINT, run.seen
    assert printed == ""
    assert "Traceback" not in run.seen
    assert not out.exists()


def test_stopped_while_it_writes_a_command_leaves_the_old_files_and_no_parts(tmp_path, monkeypatch):
    first, second = tmp_path / "first", tmp_path / "second"
    first.write_text("old")

    def write(path, text, **options):
        if path.name.startswith("second"):
            raise KeyboardInterrupt
        with path.open("w") as file:
            file.write(text)

    monkeypatch.setattr(type(first), "write_text", write)
    with pytest.raises(KeyboardInterrupt):
        write_together({first: "new", second: "new"})
    assert [path.name for path in tmp_path.iterdir()] == ["first"]
    assert first.read_text() == "old"

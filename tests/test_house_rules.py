"""Rules of the house that no other tool checks."""

import subprocess
import sys
from pathlib import Path

from robocal.identification.strategies import STRATEGIES
from robocal.robots.library import ROBOTS
from service.cli import COMMANDS
from service.main import create_app
from service.settings import Settings

ROOT = Path(__file__).parents[1]
MOST_LINES = 400
FORBIDDEN_WORDS = ("utils", "util", "helpers", "helper", "common", "misc", "manager", "handler")
TEXT = {
    ".py",
    ".js",
    ".html",
    ".css",
    ".yaml",
    ".yml",
    ".toml",
    ".md",
    ".json",
    ".ini",
    ".txt",
    ".csv",
    ".mako",
    ".lock",
    "",
}


def committed() -> list[Path]:
    """Files under version control, or all sources where there is no repository."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached"], cwd=ROOT, capture_output=True, check=False
    )
    if listed.returncode == 0:
        paths = [ROOT / name for name in listed.stdout.decode().split("\0") if name]
    else:
        folders = ("robocal", "drivers", "service", "tests", "migrations", "docs")
        paths = [path for folder in folders for path in (ROOT / folder).rglob("*")]
    return [path for path in paths if path.is_file() and "__pycache__" not in path.parts]


COMMITTED = committed()
MODULES = [path for path in COMMITTED if path.suffix in {".py", ".js"}]


def shown(paths: list[Path]) -> list[str]:
    return sorted(str(path.relative_to(ROOT)) for path in paths)


def stems(folder: str, suffix: str) -> set[str]:
    """Names of the committed modules or data files in a folder that must be registered."""
    found = {path.stem for path in COMMITTED if path.parent == ROOT / folder}
    found &= {path.stem for path in (ROOT / folder).glob(f"*{suffix}")}
    return {name for name in found if not name.startswith("_")}


def test_the_modules_are_found():
    assert len(MODULES) > 100


def test_no_module_is_longer_than_400_lines():
    long = {
        str(path.relative_to(ROOT)): count
        for path in MODULES
        if (count := len(path.read_text(encoding="utf-8").splitlines())) > MOST_LINES
    }
    assert not long


def test_no_file_name_says_nothing():
    vague = [path for path in MODULES if set(path.stem.lower().split("_")) & set(FORBIDDEN_WORDS)]
    assert not shown(vague)


def test_every_robot_file_is_in_the_library():
    assert stems("robocal/robots", ".yaml") == set(ROBOTS)


def test_every_robot_names_the_source_of_its_table():
    without = [
        path
        for path in (ROOT / "robocal" / "robots").glob("*.yaml")
        if "# Source: " not in path.read_text(encoding="utf-8")
    ]
    assert not shown(without)


def test_every_command_file_is_a_command():
    in_folder = stems("service/commands", ".py") - {"options"}
    registered = {command.__module__.rpartition(".")[2] for command in COMMANDS}
    assert in_folder <= registered
    assert len(COMMANDS) == len(set(COMMANDS))


def test_every_strategy_file_is_a_strategy():
    """A strategy is a module that offers a function from a Problem to a Fit."""
    folder = ROOT / "robocal" / "identification"
    offers = {
        path.stem
        for path in folder.glob("*.py")
        if "(problem: Problem) -> Fit:" in path.read_text(encoding="utf-8")
    }
    registered = {how.__module__.rpartition(".")[2] for how in STRATEGIES.values()}
    assert offers == registered


def test_every_protocol_of_the_numerics_can_be_checked_at_run_time():
    """The tests check annotations as they run; on a bare Protocol that is an error on import."""
    bare = []
    for path in MODULES:
        if path.is_relative_to(ROOT / "robocal"):
            lines = path.read_text(encoding="utf-8").splitlines()
            bare += [
                f"{path.relative_to(ROOT)}:{number + 1}"
                for number, line in enumerate(lines)
                if "(Protocol" in line and lines[number - 1] != "@runtime_checkable"
            ]
    assert not bare


def test_the_import_contracts_hold():
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            "from importlinter.cli import lint_imports_command as c; c()",
            "--no-cache",
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "0 broken" in done.stdout


def test_no_committed_file_names_a_place_on_somebodys_machine():
    """The words are put together here so that this file does not hold them."""
    slash = "/"
    homes = [slash + word + slash for word in ("work", "root", "home", "Users")]
    found = []
    for path in COMMITTED:
        if path.suffix not in TEXT or path.name == "openapi.json":
            continue
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            if any(home in line for home in homes):
                found.append(f"{path.relative_to(ROOT)}:{number}: {line.strip()[:80]}")
    assert not found


def test_every_route_says_who_may_call_it():
    """Making the application refuses a route without a line in service/access/scopes.py."""
    create_app(Settings())

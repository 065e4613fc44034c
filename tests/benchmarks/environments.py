"""An environment of its own for every peer, made when first needed.

pybotics and robotkinecal want numpy 1, pinocchio wants numpy 2: one environment cannot hold them.
"""

import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).parent / "peers"
ENVIRONMENTS = Path(__file__).parents[2] / ".venv-peers"


class PeerMissing(Exception):
    """A peer cannot be installed or does not run here; says why in one line."""


@dataclass(frozen=True)
class Peer:
    """A program of a peer and the environment that it runs in."""

    environment: str
    program: str

    def run(self, *arguments: object) -> dict:
        """What the program reports.

        Raises
        ------
        PeerMissing
            If it cannot be installed or fails.
        """
        python = _python_of(self.environment)
        with tempfile.TemporaryDirectory() as folder:
            result = Path(folder) / "result.json"
            first, *more = (str(argument) for argument in arguments)
            program = FOLDER / f"{self.program}.py"
            _call([str(python), str(program), first, str(result), *more], self.program)
            return json.loads(result.read_text())


def _python_of(name: str) -> Path:
    """Interpreter of an environment that holds what its requirements file says."""
    requirements = FOLDER / f"{name}.txt"
    folder = ENVIRONMENTS / name
    python = folder / "bin" / "python"
    installed = folder / "installed.txt"
    wanted = requirements.read_text()
    if not installed.exists() or installed.read_text() != wanted:
        sys.stderr.write(f"installing {name} into {folder.relative_to(ENVIRONMENTS.parent)}\n")
        _call([sys.executable, "-m", "venv", "--clear", str(folder)], name)
        pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        _call([*pip, "-r", str(requirements)], name)
        installed.write_text(wanted)
    return python


def _call(command: list[str], name: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        said = (done.stderr.strip() or done.stdout.strip() or "it said nothing").splitlines()[-1]
        raise PeerMissing(f"{name} is skipped: {said}")


PYBOTICS = Peer("pybotics", "with_pybotics")
FIGAROH = Peer("figaroh", "with_figaroh")
ROBOTKINECAL = Peer("robotkinecal", "with_robotkinecal")
PINOCCHIO = Peer("figaroh", "with_pinocchio")

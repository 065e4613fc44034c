"""Bundles with something hidden, written by the emulated world's own program, and diagnosed."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]
STAUBLI = ROOT / "tests" / "blind" / "robots" / "staubli_tx60_with_masses.yaml"


def write_cases(folder: Path, *options: str, robot: Path = STAUBLI) -> Path:
    """Bundles `0000`, `0001`, ... and beside them `truth/0000.json`, ...; the folder.

    One process writes all: starting one takes longer than writing a bundle.
    """
    program = [sys.executable, "-m", "drivers.emulators.dataset", "--robot", str(robot)]
    places = ["--out", str(folder), "--truth", str(folder / "truth")]
    subprocess.run([*program, *places, *options], cwd=ROOT, check=True)
    return folder


def run_diagnose(call, bundle: Path, out: Path) -> str:
    """`robocal diagnose`, which must not complain; what it printed."""
    status, printed, complaint = call("diagnose", bundle, "--out", out)
    assert (status, complaint) == (0, "")
    return printed

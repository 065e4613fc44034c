"""Forward kinematics beside pinocchio's Python loop, and memory over ten million poses.

`python -m tests.benchmarks.kinematics POSES` prints the most memory [KiB] that one process held.
"""

import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from robocal.kinematics.forward import forward_kinematics, pose_blocks
from tests.benchmarks.campaign import campaign
from tests.benchmarks.environments import PINOCCHIO, PeerMissing
from tests.benchmarks.report import Goal, table

POSES = 200_000
LOOP_POSES = 50_000
ROUNDS = 5
STREAMED = (100_000, 1_000_000, 10_000_000)
PIECE = 20_000
FLAT = 1.1
"""Memory over the most poses, as a multiple of that over the fewest, that counts as flat"""


def our_rates(rounds: int) -> list[float]:
    """Poses per CPU second."""
    model = campaign(1).nominal
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (POSES, 6))
    rates = []
    for _ in range(rounds):
        began = time.process_time()
        forward_kinematics(model, q)
        rates.append(POSES / (time.process_time() - began))
    return rates


def pinocchio_rates() -> list[float]:
    """The same of pinocchio; its poses are compared with ours on the way."""
    measured = campaign(1)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "campaign.npz"
        measured.save(path)
        report = PINOCCHIO.run(path, LOOP_POSES, ROUNDS)
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (LOOP_POSES, 6))[:100]
    own = forward_kinematics(measured.nominal, q)[:, :3, 3]
    np.testing.assert_allclose(own, report["positions"], atol=1e-12)
    return report["rates"]


def stream(n_poses: int) -> int:
    """Most memory [KiB] that this process held while so many poses went through."""
    model = campaign(1).nominal
    rng = np.random.default_rng(0)
    pieces = (rng.uniform(-np.pi, np.pi, (PIECE, 6)) for _ in range(n_poses // PIECE))
    farthest = max(float(np.abs(T[:, :3, 3]).max()) for T in pose_blocks(model, pieces))
    assert 0.0 < farthest < 3.0
    # getrusage would count what the parent held when it started this process.
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM:"))


def memory() -> dict[int, int]:
    """Most memory [KiB] by number of poses, each in a process of its own."""
    most = {}
    for n_poses in STREAMED:
        command = [sys.executable, "-m", "tests.benchmarks.kinematics", str(n_poses)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        most[n_poses] = int(done.stdout)
    return most


def run() -> tuple[str, list[Goal]]:
    """Rates and memory."""
    parts, goals = ["## Forward kinematics, UR10 with tool, one core\n"], []
    rates = our_rates(ROUNDS)
    rows = []
    try:
        loop = statistics.median(pinocchio_rates())
    except PeerMissing as missing:
        parts.append(f"{missing}\n")
    else:
        rates += our_rates(ROUNDS)
        times = statistics.median(rates) / loop
        rows.append(("pinocchio, Python loop", f"{loop:,.0f}"))
        what = "forward kinematics against pinocchio's Python loop"
        goals.append(Goal(what, f"{times:.1f} times", ">= 3", times >= 3.0))
    rows.insert(0, ("robocal", f"{statistics.median(rates):,.0f}"))
    parts.append(table(("program", "poses per CPU second"), rows) + "\n")
    most = memory()
    lines = [(f"{n:,}", f"{kib / 1024:.0f}") for n, kib in most.items()]
    parts.append(table(("poses streamed", "most memory MiB"), lines) + "\n")
    growth = most[STREAMED[-1]] / most[STREAMED[0]]
    what = f"memory over {STREAMED[-1]:,} poses against {STREAMED[0]:,}"
    goals.append(Goal(what, f"{growth:.2f} times", f"<= {FLAT}", growth <= FLAT))
    return "\n".join(parts), goals


if __name__ == "__main__":
    sys.stdout.write(f"{stream(int(sys.argv[1]))}\n")

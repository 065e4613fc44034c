"""Identification beside figaroh, pybotics and robotkinecal: CPU seconds and held-out error."""

import statistics
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from robocal.identification.cell_model import CellModel
from robocal.identification.frames_start import start_frames
from robocal.identification.observations import Observations, position_rows
from robocal.identification.priors import Choices
from robocal.identification.simultaneous import identify_simultaneously
from robocal.identification.solve import Solution, frames_alone, solve_without_outliers
from robocal.kinematics.forward import forward_kinematics
from robocal.robots.library import load_robot
from tests.benchmarks.campaign import (
    CHAIN,
    ORIENTATION_STD,
    POSITION_STD,
    ROBOT,
    Campaign,
    campaign,
)
from tests.benchmarks.environments import FIGAROH, PYBOTICS, ROBOTKINECAL, Peer, PeerMissing
from tests.benchmarks.report import Goal, table

OUR_ROUNDS = 15


@dataclass(frozen=True)
class Work:
    """One row of the comparison: what is fitted, by whom, how often."""

    name: str
    rows: int
    frames_known: bool
    fit: Callable[[Campaign], Solution]
    peers: tuple[tuple[str, Peer, tuple[str, ...]], ...]
    peer_rounds: int


@dataclass(frozen=True)
class Outcome:
    """What one program made of a campaign."""

    program: str
    parameters: int
    cpu_s: float
    mean: float
    """Of the held-out position errors [m]"""
    largest: float


def fit_chain(measured: Campaign) -> Solution:
    """The 24 parameters from positions, base and tool known."""
    start = CellModel(measured.nominal.with_frames_as_origin())
    rows = position_rows(measured.joints, measured.T[:, :3, 3], POSITION_STD)
    choices = Choices(fixed=frozenset(start.names) - CHAIN)
    return solve_without_outliers(start, rows, choices, identify_simultaneously)


def fit_chain_to_poses(measured: Campaign) -> Solution:
    """The same from full poses."""
    start = CellModel(measured.nominal.with_frames_as_origin())
    choices = Choices(fixed=frozenset(start.names) - CHAIN)
    return solve_without_outliers(start, full_poses(measured), choices, identify_simultaneously)


def fit_everything(measured: Campaign) -> Solution:
    """All 42 parameters from full poses, base and tool unknown: start, frames, everything."""
    rows = full_poses(measured)
    geometry = load_robot(ROBOT).geometry
    frames = start_frames(geometry, rows)
    placed = geometry.with_frames(frames.base, geometry.flange @ frames.tool)
    start = CellModel(placed.with_frames_as_origin(), geometry.flange)
    nominal = frames_alone(start, rows, Choices(), identify_simultaneously)
    return solve_without_outliers(nominal.cell, rows, Choices(), identify_simultaneously)


def full_poses(measured: Campaign) -> Observations:
    """Positions and orientations over their standard deviations."""
    n = len(measured.joints)
    nothing = np.zeros(n)
    return Observations(
        joints=measured.joints,
        position=np.ascontiguousarray(measured.T[:, :3, 3].T),
        axes=np.ascontiguousarray(np.moveaxis(measured.T[:, :3, :3], 0, 2)),
        distance=nothing,
        place=np.full(n, -1),
        position_weight=np.full(n, 1.0 / POSITION_STD),
        orientation_weight=np.full(n, 1.0 / ORIENTATION_STD),
        distance_weight=nothing,
    )


_POSITION_PEERS = (
    ("pybotics, as documented", PYBOTICS, ("norm",)),
    ("pybotics, x y z residuals", PYBOTICS, ("components",)),
    ("figaroh", FIGAROH, ("positions", "known")),
    ("robotkinecal", ROBOTKINECAL, ("positions",)),
)
WORKS = (
    Work("24 parameters, 50 positions", 50, True, fit_chain, _POSITION_PEERS, 3),
    Work("24 parameters, 1,000 positions", 1000, True, fit_chain, _POSITION_PEERS, 1),
    Work(
        "42 columns (rank 30), 1,000 full poses, frames unknown",
        1000,
        False,
        fit_everything,
        (("figaroh", FIGAROH, ("poses", "unknown")),),
        1,
    ),
    Work(
        "24 parameters, the same full poses, frames known",
        1000,
        True,
        fit_chain_to_poses,
        (
            ("figaroh", FIGAROH, ("poses", "known")),
            ("robotkinecal", ROBOTKINECAL, ("poses",)),
        ),
        1,
    ),
)


def our_times(work: Work, measured: Campaign) -> list[float]:
    """CPU seconds of several fits, after one that fills the caches."""
    work.fit(measured)
    times = []
    for _ in range(OUR_ROUNDS):
        began = time.process_time()
        work.fit(measured)
        times.append(time.process_time() - began)
    return times


def ours(work: Work, measured: Campaign, times: list[float]) -> Outcome:
    """What robocal makes of the campaign."""
    solution = work.fit(measured)
    T = forward_kinematics(solution.fit.cell.geometry, measured.held_out_joints)
    cpu = statistics.median(times)
    return Outcome("robocal", len(solution.problem.free), cpu, *measured.errors(T[:, :3, 3]))


def theirs(work: Work, measured: Campaign, name: str, peer: Peer, how: tuple[str, ...]) -> Outcome:
    """What a peer makes of it."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "campaign.npz"
        measured.save(path)
        reports = [peer.run(path, *how) for _ in range(work.peer_rounds)]
    cpu = statistics.median(report["cpu_s"] for report in reports)
    errors = measured.errors(np.array(reports[0]["positions"]))
    return Outcome(name, reports[0]["parameters"], cpu, *errors)


def compare(work: Work) -> tuple[list[Outcome], list[str]]:
    """Outcomes of all programs on one campaign, ours first; why a peer is missing.

    Our fits run before and after the peers', as the machine may be busier at one time.
    """
    measured = campaign(work.rows, frames_known=work.frames_known)
    times = our_times(work, measured)
    peers, skipped = [], []
    for name, peer, how in work.peers:
        try:
            peers.append(theirs(work, measured, name, peer, how))
        except PeerMissing as missing:
            skipped.append(str(missing))
    times += our_times(work, measured)
    return [ours(work, measured, times), *peers], skipped


def shown(work: Work, outcomes: list[Outcome]) -> str:
    """The table of one work."""
    own = outcomes[0].cpu_s
    rows = [
        (
            out.program,
            str(out.parameters),
            f"{out.cpu_s:.4f}",
            f"{out.cpu_s / own:.0f}",
            f"{out.mean * 1e3:.4f}",
            f"{out.largest * 1e3:.4f}",
        )
        for out in outcomes
    ]
    head = ("program", "free", "CPU s", "times ours", "held-out mean mm", "max mm")
    return f"### {work.name}\n\n{table(head, rows)}\n"


def goals(work: Work, outcomes: list[Outcome]) -> list[Goal]:
    """The issue's figures for one work."""
    own, peers = outcomes[0], outcomes[1:]
    if work is WORKS[0]:
        return [_faster(work, own, peer, 150) for peer in peers if "kinecal" not in peer.program]
    if work is WORKS[1]:
        return [_faster(work, own, peer, 400) for peer in peers if peer.program == "figaroh"]
    found = [
        Goal(
            f"{work.name}, held-out mean against {peer.program}",
            f"{own.mean * 1e3:.4f} mm against {peer.mean * 1e3:.4f} mm",
            "no more",
            own.mean <= peer.mean,
        )
        for peer in peers
    ]
    if work is WORKS[2]:
        most = 0.15
        what = f"{work.name}, robocal"
        found.append(Goal(what, f"{own.cpu_s:.3f} CPU s", f"<= {most}", own.cpu_s <= most))
    return found


def _faster(work: Work, own: Outcome, peer: Outcome, factor: int) -> Goal:
    times = peer.cpu_s / own.cpu_s
    what = f"{work.name}, {peer.program}"
    return Goal(what, f"1/{times:.0f} of its CPU time", f"<= 1/{factor}", times >= factor)


def run() -> tuple[str, list[Goal]]:
    """All works."""
    parts, found = ["## Identification\n"], []
    for work in WORKS:
        outcomes, skipped = compare(work)
        parts += [shown(work, outcomes), *(f"{sentence}\n" for sentence in skipped)]
        found += goals(work, outcomes)
    return "\n".join(parts), found

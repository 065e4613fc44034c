"""Document 001 run again: tables 2 to 5 side by side, both methods, many noise draws.

``python -m service.reproduce.base_calibration [--draws 1000] [--seed 1]`` prints Markdown.
"""

import argparse
import sys
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.base_calibration.projection import Projection, project
from robocal.frames import xyz_ypr_from_frame
from service.reproduce.base_calibration_draws import (
    PERFECT_STAGE,
    Errors,
    draw_projection,
    draw_registration,
    draw_within_rounding,
    errors_of,
    paper_layout,
    touches_of,
    wide_layout,
)
from service.reproduce.base_calibration_paper import (
    EXPERIMENTS,
    PAPER_ERRORS,
    Experiment,
    Printed,
    arm,
    scara,
)

_ALIGNED = np.tile([0.0, np.pi / 2, 0.0], (4, 1))
_GENERAL = np.array([[0.5, 1.2, 0.6], [-0.5, 1.9, -0.4], [0.4, 1.8, -0.7], [-0.6, 1.3, 0.5]])
"""Wrists off the paper's alignment: there the needle's yaw is no polar angle [rad]"""
_GENERAL_ELBOW = 0.5
_MIDDLE = (2.5, 97.5)
"""Bounds of the middle 95 % [%]"""


@dataclass(frozen=True)
class Comparison:
    """One experiment at one amplitude, printed and found."""

    experiment: Experiment
    printed: Printed
    own_draw: Projection
    """Our projection on the paper's own noisy joints."""
    rounding: Errors
    """The same on all joints that are printed alike."""
    projection: Errors
    same_touches: Errors
    """Weighted least squares on the projection's own 2 + 2 touches."""
    registration: Errors
    """4 + 4 touches, wrists as in the paper."""
    general: Errors
    """4 + 4 touches, general wrists."""
    refusal: str
    """What the projection method says of a general touch."""


def compare(draws: int, seed: int) -> tuple[Comparison, ...]:
    """All four rows of the paper's tables."""
    return tuple(
        _compare(experiment, printed, draws, seed)
        for experiment in EXPERIMENTS
        for printed in experiment.printed
    )


def _compare(experiment: Experiment, printed: Printed, draws: int, seed: int) -> Comparison:
    amplitude, paper = printed.amplitude, paper_layout(experiment)
    own = project(touches_of(paper, amplitude, printed.master, printed.slave), PERFECT_STAGE)
    aligned = wide_layout(experiment, _ALIGNED, 0.0)
    general = wide_layout(experiment, _GENERAL, _GENERAL_ELBOW)
    return Comparison(
        experiment,
        printed,
        own,
        draw_within_rounding(experiment, printed, draws, seed),
        draw_projection(experiment, amplitude, draws, seed),
        draw_registration(experiment, paper, amplitude, draws, seed),
        draw_registration(experiment, aligned, amplitude, draws, seed),
        draw_registration(experiment, general, amplitude, draws, seed),
        _refusal(experiment, amplitude),
    )


def _refusal(experiment: Experiment, amplitude: float) -> str:
    """The paper's four touches with the slave's elbow bent."""
    paper = paper_layout(experiment)
    slave = experiment.slave_joints + np.array([0.0, _GENERAL_ELBOW, 0.0, 0.0])
    return project(
        touches_of(paper, amplitude, experiment.master_joints, slave), PERFECT_STAGE
    ).refusal


def report(rows: tuple[Comparison, ...]) -> str:
    """The comparison as Markdown."""
    lines = ["### Tables 2 and 3: touch points from the printed joints [m]", ""]
    lines += ["| exp. | ampl. | touch | printed | ours | difference mm |", "|--|--|--|--|--|--|"]
    for row in rows:
        lines += _points(row)
    lines += ["", "### Table 4: the views' answers on the printed joints", ""]
    lines += ["| exp. | ampl. | | x1 | y1 | z1 | x2 | y2 | z2 | alpha | beta | gamma |"]
    lines += ["|--|--|--|--|--|--|--|--|--|--|--|--|"]
    for row in rows:
        lines += _views(row)
    lines += [
        "",
        f"### Table 5 and {len(rows[0].projection.rot)} draws: e_rot [rad], e_tran [mm]",
        "",
    ]
    lines += [
        "| exp. | ampl. | printed | projection, printed joints | e_tran within their rounding, "
        "95 % | projection, median | draws no worse than printed | least squares, same touches, "
        "median | registration 4 + 4, median | general touches, median |",
        "|--|--|--|--|--|--|--|--|--|--|",
    ]
    lines += [_table_5(row) for row in rows]
    lines += ["", f"General touches, projection method: {rows[0].refusal}.", ""]
    lines += ["### Errors in the paper", "", *(f"- {error}" for error in PAPER_ERRORS)]
    return "\n".join(lines) + "\n"


def _points(row: Comparison) -> list[str]:
    ours = np.concatenate([
        arm().needle_poses(row.printed.master)[:, :3, 3],
        scara().needle_poses(row.printed.slave)[:, :3, 3],
    ])
    return [
        f"| {row.experiment.number} | {row.printed.amplitude} | {name} | {_row(printed)} | "
        f"{_row(found)} | {np.linalg.norm(found - printed) * 1e3:.2f} |"
        for name, printed, found in zip(
            ("P1", "P2", "R1", "R2"), row.printed.points, ours, strict=True
        )
    ]


def _views(row: Comparison) -> list[str]:
    own, head = row.own_draw, f"| {row.experiment.number} | {row.printed.amplitude} |"
    if own.transform is None or own.first is None or own.second is None:
        return [f"{head} ours | {own.refusal} |"]
    yaw, pitch, roll = xyz_ypr_from_frame(own.transform)[3:]
    printed = np.array([*row.printed.first, *row.printed.second, *row.printed.angles])
    ours = np.array([*own.first, *own.second, roll, pitch, yaw])
    return [
        f"{head} {name} | " + " | ".join(f"{value:.4f}" for value in values) + " |"
        for name, values in (("printed", printed), ("ours", ours))
    ]


def _table_5(row: Comparison) -> str:
    printed = (row.printed.e_rot, row.printed.e_tran)
    own = None
    if row.own_draw.transform is not None:
        own = errors_of(row.own_draw.transform, row.experiment)
    no_worse = (
        float(np.mean(row.projection.rot <= printed[0])),
        float(np.mean(row.projection.tran <= printed[1])),
    )
    cells = [
        str(row.experiment.number),
        str(row.printed.amplitude),
        _pair(printed),
        row.own_draw.refusal if own is None else _pair(own),
        " to ".join(f"{e * 1e3:.2f}" for e in np.percentile(row.rounding.tran, _MIDDLE)),
        _pair(_median(row.projection)),
        f"{no_worse[0]:.0%}, {no_worse[1]:.0%}",
        _pair(_median(row.same_touches)),
        _pair(_median(row.registration)),
        _pair(_median(row.general)),
    ]
    return "| " + " | ".join(cells) + " |"


def _median(errors: Errors) -> tuple[float, float]:
    return float(np.median(errors.rot)), float(np.median(errors.tran))


def _pair(errors: tuple[float, float]) -> str:
    return f"{errors[0]:.1e}, {errors[1] * 1e3:.2f}"


def _row(values: Float[Array, "3"]) -> str:
    return ", ".join(f"{value:.4f}" for value in values)


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    sys.stdout.write(report(compare(options.draws, options.seed)))


if __name__ == "__main__":
    main()

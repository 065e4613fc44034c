"""How often do the stated 95 % intervals hold the truth?

`python -m tests.studies.coverage --campaigns 1000` prints one line a robot and kind of measurement.
Every campaign has a truth of its own, drawn about the nominal robot with the prior's standard
deviations (1 mm, 5 mrad) or with a fifth of them; only parameters that the poses can tell apart or
that the prior holds are off, as the others have no truth of their own. Readings come from
elementary matrices and share no code with robocal; all campaigns are fitted at once.
"""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.spatial.transform import Rotation

from robocal.formats.bundle import read_bundle
from robocal.identification.cell_model import CellModel
from robocal.identification.identify import identify
from robocal.identification.priors import PRIOR_ANGLE, PRIOR_LENGTH
from robocal.kinematics.model import KinematicModel
from robocal.uncertainty.fitted_rows import FittedRows, fitted_rows
from robocal.uncertainty.many_cells import draws_at_place, many_jacobians, many_targets
from robocal.uncertainty.many_fits import Estimator, ManyFits, Readings, fit_many
from robocal.uncertainty.propagation import coverage_factor
from robocal.uncertainty.tool_pose import coverage_radius
from tests.elementary_kinematics import Arm
from tests.measured_cell import measure, true_cell, write_bundle

POSES = 50
NEW_POSES = 10
ROBOTS = ("staubli_tx60", "ur10e")
PIECE = 40


@dataclass(frozen=True)
class Coverage:
    """Shares of the campaigns whose interval holds the truth."""

    names: tuple[str, ...]
    parameters: np.ndarray
    coordinates: np.ndarray
    """x, y, z of the tool at each new pose."""
    balls: np.ndarray
    """The 95 % radius at each new pose."""


def run(robot: str, campaigns: int, seed: int, *, full_pose: bool, wrong: float) -> Coverage:
    """Measure and fit so many campaigns.

    Parameters
    ----------
    wrong
        Size of the true errors in standard deviations of the prior.
    """
    with TemporaryDirectory() as folder:
        cell = true_cell(robot, seed, wrong=())
        write_bundle(Path(folder), robot, cell, POSES, seed, full_pose=full_pose)
        bundle = read_bundle(Path(folder))
    everything = replace(bundle.measurements, held_out=np.zeros(POSES, dtype=bool))
    bundle = replace(bundle, measurements=everything)
    fit = fitted_rows(bundle, identify(bundle))
    rng = np.random.default_rng([seed, 7])
    new_q = cell.nominal.draw(rng, NEW_POSES, widest=2.5)
    inside = [_piece(fit, cell.true, new_q, wrong, rng) for _ in range(-(-campaigns // PIECE))]
    parameters, coordinates, balls = (
        np.concatenate(part)[:campaigns].mean(axis=0) for part in zip(*inside, strict=True)
    )
    names = tuple(fit.cell.names[k] for k in fit.free)
    return Coverage(names, parameters, coordinates, balls)


def _piece(fit: FittedRows, nominal: Arm, new_q, wrong: float, rng: np.random.Generator):
    """Whether each interval of each campaign of a piece holds the truth."""
    links = fit.free[fit.free < 5 * fit.cell.geometry.n_joints]
    std = np.where(fit.cell.is_angle[links], PRIOR_ANGLE, PRIOR_LENGTH)
    arms, truths = [], []
    for _ in range(PIECE):
        link_rows = nominal.links.ravel().copy()
        link_rows[links] += wrong * std * rng.normal(size=len(links))
        arms.append(replace(nominal, links=link_rows.reshape(-1, 5)))
        truths.append(np.concatenate([link_rows, np.zeros(12)])[fit.free])
    cell = _cell(nominal, fit)
    estimator = Estimator(cell, fit.rows, fit.free, fit.prior_precision)
    readings = _measured(arms, fit, rng)
    found = fit_many(estimator, readings, np.repeat(cell.vector[fit.free][:, None], PIECE, axis=1))
    assert found.settled.all()
    away = found.vectors[fit.free].T - np.array(truths)
    k = coverage_factor(np.inf)
    parameters = np.abs(away) <= k * np.sqrt(np.einsum("dff->df", found.covariance))
    return parameters, *_tool_inside(cell, fit, found, arms, new_q)


def _cell(nominal: Arm, fit: FittedRows) -> CellModel:
    """Nominal links in the true frames: where every fit starts, and the mean of the prior."""
    links = nominal.links.copy()
    geometry = KinematicModel(
        links, fit.cell.geometry.prismatic, station=nominal.base, flange=nominal.tool
    )
    return CellModel(geometry, fit.cell.flange)


def _measured(arms: list[Arm], fit: FittedRows, rng: np.random.Generator) -> Readings:
    q = fit.rows.joints
    position = np.empty((3, len(arms), len(q)))
    axes = np.empty((3, 3, len(arms), len(q)))
    for draw, arm in enumerate(arms):
        p, quaternion = measure(arm, q, rng)
        position[:, draw] = p.T
        turn = Rotation.from_quat(np.roll(quaternion, -1, axis=1)).as_matrix()
        axes[:, :, draw] = np.moveaxis(turn, 0, 2)
    return Readings(position, axes, np.zeros((len(arms), len(q))))


def _tool_inside(cell: CellModel, fit: FittedRows, found: ManyFits, arms: list[Arm], new_q):
    """Whether the intervals of the tool's position at new poses hold the true one."""
    model, mine = draws_at_place(cell, found.vectors, -1)
    targets = many_targets(model, mine, new_q)
    shape = (3, PIECE, NEW_POSES)
    J = many_jacobians(targets)[fit.free][:, :3].reshape(len(fit.free), *shape)
    covariance = np.einsum("aidm,dab,bjdm->dmij", J, found.covariance, J, optimize=True)
    truth = np.stack([arm.poses(new_q)[:, :3, 3] for arm in arms])
    away = np.moveaxis(targets.target.p.reshape(shape), 0, 2) - truth
    std = np.sqrt(np.einsum("dmii->dmi", covariance))
    coordinates = np.abs(away) <= coverage_factor(np.inf) * std
    flat = covariance.reshape(-1, 3, 3)
    radius = coverage_radius(flat, np.full(len(flat), np.inf)).reshape(PIECE, NEW_POSES)
    balls = np.linalg.norm(away, axis=2) <= radius
    return coordinates.reshape(PIECE, -1), balls


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--campaigns", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    print(
        f"{'robot':14}{'rows':>12}{'errors':>8}{'campaigns':>11}"
        f"{'parameters: mean, least, most':>42}{'tool xyz: least, most':>24}{'ball':>16}"
    )
    for robot in ROBOTS:
        for full_pose in (True, False):
            for wrong in (1.0, 0.2):
                found = run(
                    robot,
                    arguments.campaigns,
                    arguments.seed,
                    full_pose=full_pose,
                    wrong=wrong,
                )
                print(_line(robot, arguments.campaigns, found, full_pose, wrong), flush=True)


def _line(robot: str, campaigns: int, found: Coverage, full_pose: bool, wrong: float) -> str:
    kind = "full poses" if full_pose else "positions"
    least, most = np.argmin(found.parameters), np.argmax(found.parameters)
    ends = (
        f"{found.parameters.mean():.1%}, {found.parameters[least]:.1%} {found.names[least]}, "
        f"{found.parameters[most]:.1%} {found.names[most]}"
    )
    tool = f"{found.coordinates.min():.1%}, {found.coordinates.max():.1%}"
    ball = f"{found.balls.min():.1%}, {found.balls.max():.1%}"
    return f"{robot:14}{kind:>12}{wrong:8.1f}{campaigns:11d}{ends:>42}{tool:>24}{ball:>16}"


if __name__ == "__main__":
    main()

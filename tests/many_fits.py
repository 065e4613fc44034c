"""Errors of 200 seeded fits of one cell, in a process without the tests' type checks.

Run as `python -m tests.many_fits`; prints the errors [m] at four poses and the first fit's stated
covariances [m2] as JSON.
"""

import json
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from robocal.formats.bundle import read_bundle
from robocal.identification.identify import identify
from robocal.identification.result import Identification
from robocal.kinematics.forward import forward_kinematics
from robocal.kinematics.model import parameter_names
from tests.measured_cell import measure, true_cell, write_bundle

FITS = 200
ROBOT = "staubli_tx60"
SEED = 3


def moved_links(result: Identification) -> tuple[str, ...]:
    """Names of the link parameters that moved."""
    names = parameter_names(result.model.n_joints)
    return tuple(names[k] for k in result.free if k < 5 * result.model.n_joints)


def position_covariance(result: Identification, q: np.ndarray) -> np.ndarray:
    """Covariance of the target at one pose, by differences over the free parameters."""
    model = result.model
    columns = []
    for index in result.free:
        unit = np.eye(model.n_parameters)[index] * 1e-6
        up, down = (
            forward_kinematics(model.with_vector(model.vector + sign * unit), q[None])[0, :3, 3]
            for sign in (1, -1)
        )
        columns.append((up - down) / 2e-6)
    J = np.array(columns).T
    return J @ result.covariance @ J.T


def main() -> None:
    """The same poses measured again and again."""
    with tempfile.TemporaryDirectory() as folder:
        write_bundle(Path(folder), ROBOT, true_cell(ROBOT, SEED, wrong=()), rows=30, seed=SEED)
        pilot = identify(read_bundle(Path(folder)))
        cell = true_cell(ROBOT, SEED, wrong=moved_links(pilot))
        write_bundle(Path(folder), ROBOT, cell, rows=30, seed=SEED)
        bundle = read_bundle(Path(folder))
    everything = replace(bundle.measurements, held_out=np.zeros(30, dtype=bool))
    rng = np.random.default_rng(8)
    q_new = cell.nominal.draw(rng, 4, widest=2.0)
    truth = cell.true.poses(q_new)[:, :3, 3]
    errors = []
    covariances = None
    for _ in range(FITS):
        position, quaternion = measure(cell.true, everything.joints, rng)
        rows = replace(everything, position=position, orientation=quaternion)
        result = identify(replace(bundle, measurements=rows))
        if covariances is None:
            covariances = [position_covariance(result, q).tolist() for q in q_new]
        errors.append((forward_kinematics(result.model, q_new)[:, :3, 3] - truth).tolist())
    sys.stdout.write(json.dumps({"errors": errors, "covariances": covariances}))


if __name__ == "__main__":
    main()

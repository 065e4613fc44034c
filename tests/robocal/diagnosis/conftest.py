"""Positions of a cell, measured and diagnosed."""

import json

import numpy as np
import pytest

from tests.measured_cell import CAMPAIGN, header, measure, true_cell, write_bundle
from tests.robocal.diagnosis.hidden_cases import run_diagnose

ROBOT = "ur10e"
HELD_OUT = "held_out: {column: split}\n"


@pytest.fixture
def found(call, tmp_path):
    """Diagnose positions of a cell.

    `still` joints stand, every pose is read `times` times, `wrong` rows are a millimetre off.
    """

    def diagnose(
        seed, poses=60, times=1, still=(), moved=lambda q: q, noise=1.0, checked=4, wrong=()
    ):
        bundle, cell = tmp_path / "bundle", true_cell(ROBOT, seed)
        q = write_bundle(bundle, ROBOT, cell, poses, full_pose=False)
        q[:, still] = 0.3
        q, pose = np.repeat(q, times, axis=0), np.repeat(np.arange(poses), times)
        position, _ = measure(cell.true, moved(q), np.random.default_rng(seed), noise)
        position[list(wrong)] += 1e-3
        lines = [",".join([*header(cell.nominal, full_pose=False), "pose", "split"])]
        for reading, place, number in zip(np.degrees(q), position * 1e3, pose, strict=True):
            numbers = ",".join(f"{value:.9f}" for value in (*reading, *place))
            lines.append(
                f"{numbers},{number},{'check' if number % checked == checked - 1 else 'fit'}"
            )
        (bundle / "measurements.csv").write_text("\n".join(lines) + "\n")
        (bundle / "campaign.yaml").write_text(CAMPAIGN + HELD_OUT)
        printed = run_diagnose(call, bundle, tmp_path / "out")
        return printed, json.loads((tmp_path / "out" / "diagnosis.json").read_text())

    return diagnose

"""Fit a campaign with figaroh, as its robots' examples do: initialize, then solve.

`python with_figaroh.py CAMPAIGN.npz RESULT.json positions|poses known|unknown`; the last word says
whether base and tool are given or found.
"""

import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pinocchio as pin
import yaml
from figaroh.calibration.base_calibration import BaseCalibration
from figaroh.calibration.calibration_tools import calc_updated_fkm
from pinocchio.robot_wrapper import RobotWrapper

N_JOINTS = 6


def urdf_of(data: np.lib.npyio.NpzFile) -> str:
    """The nominal robot: joint i+1 stands at Rx(alpha) Tx(a) after Rz Tz(d) of joint i."""
    alpha, a, _, d = data["craig"].T
    links = [f'<link name="link{k}"/>' for k in range(N_JOINTS + 1)] + ['<link name="tool"/>']
    joints = []
    for k in range(N_JOINTS):
        before = d[k - 1] if k else 0.0
        joints.append(
            f'<joint name="joint{k + 1}" type="revolute"><parent link="link{k}"/>'
            f'<child link="link{k + 1}"/><axis xyz="0 0 1"/>'
            f'<origin xyz="{a[k]:.17g} 0 {before:.17g}" rpy="{alpha[k]:.17g} 0 0"/>'
            '<limit lower="-6.283" upper="6.283" effort="1" velocity="1"/></joint>'
        )
    x, y, z = data["tool"] + [0.0, 0.0, d[-1]]
    joints.append(
        '<joint name="at_tool" type="fixed"><parent link="link6"/><child link="tool"/>'
        f'<origin xyz="{x:.17g} {y:.17g} {z:.17g}" rpy="0 0 0"/></joint>'
    )
    return f'<robot name="ur10">{"".join(links + joints)}</robot>'


def config_of(folder: Path, rows: int, kind: str) -> dict:
    """figaroh's settings; all six offsets of every joint may move."""
    turned = kind == "poses"
    task = {
        "enabled": True,
        "kinematics": {"base_frame": "universe", "tool_frame": "tool"},
        "parameters": {"calibration_level": "full_params"},
        "measurements": {"markers": [{"name": "smr", "measurable_dof": [True] * 3 + [turned] * 3}]},
        "data": {"number_of_samples": rows, "source_file": str(folder / "rows.csv")},
    }
    names = [f"joint{k + 1}" for k in range(N_JOINTS)]
    properties = {"joints": {"active_joints": names}}
    return {"robot": {"name": "ur10", "properties": properties}, "tasks": {"calibration": task}}


def write_rows(folder: Path, data: np.lib.npyio.NpzFile) -> None:
    """The campaign in figaroh's columns."""
    T = data["T"]
    rpy = np.array([pin.rpy.matrixToRpy(pose[:3, :3]) for pose in T])
    columns = ["x1", "y1", "z1", "phix1", "phiy1", "phiz1"]
    columns += [f"joint{k + 1}" for k in range(N_JOINTS)]
    table = np.hstack([T[:, :3, 3], rpy, data["joints"]])
    pd.DataFrame(table, columns=columns).to_csv(folder / "rows.csv", index=False)


class Calibration(BaseCalibration):
    """Residuals over their standard deviations."""

    stds = (1.0, 1.0)

    def cost_function(self, var: np.ndarray) -> np.ndarray:
        predicted = calc_updated_fkm(self.model, self.data, var, self.q_measured, self.calib_config)
        residual = self._compute_logmap_residuals(self.PEE_measured, predicted)
        return self.apply_measurement_weighting(
            residual, pos_weight=1.0 / self.stds[0], orient_weight=1.0 / self.stds[1]
        )


def main(campaign: str, result: str, kind: str, frames: str) -> None:
    data = np.load(campaign)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "robot.urdf").write_text(urdf_of(data))
        config = folder / "config.yaml"
        config.write_text(yaml.safe_dump(config_of(folder, len(data["T"]), kind)))
        write_rows(folder, data)
        robot = RobotWrapper.BuildFromURDF(str(folder / "robot.urdf"))
        calibration = Calibration(robot, str(config))
        calibration.stds = (float(data["position_std"]), float(data["orientation_std"]))
        for frame in ("known_baseframe", "known_tipframe"):
            calibration.calib_config[frame] = frames == "known"
        began = time.process_time()
        calibration.initialize()
        solved = calibration.solve(enable_logging=False)
        cpu = time.process_time() - began
    joints = data["held_out_joints"]
    elsewhere = dict(calibration.calib_config, NbSample=len(joints))
    flat = calc_updated_fkm(robot.model, robot.data, solved.x, joints, elsewhere)
    outcome = {
        "cpu_s": cpu,
        "parameters": len(solved.x),
        "positions": flat.reshape(-1, len(joints))[:3].T.tolist(),
    }
    Path(result).write_text(json.dumps(outcome))


if __name__ == "__main__":
    main(*sys.argv[1:])

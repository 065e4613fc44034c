"""Fit a campaign with pybotics, as its calibration example does: one distance a pose.

`python with_pybotics.py CAMPAIGN.npz RESULT.json norm|components`; `components` gives the solver x,
y and z instead of their distance, which it does not stall on.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
from pybotics.geometry import position_from_matrix
from pybotics.kinematic_chain import MDHKinematicChain
from pybotics.optimization import OptimizationHandler, optimize_accuracy
from pybotics.robot import Robot
from pybotics.tool import Tool
from scipy.optimize import least_squares

_MM = 1000.0


def robot_of(data: np.lib.npyio.NpzFile) -> Robot:
    """The nominal robot in [mm] and [rad]."""
    table = data["craig"] * [1.0, _MM, 1.0, _MM]
    robot = Robot(kinematic_chain=MDHKinematicChain.from_parameters(table))
    robot.tool = Tool()
    robot.tool.position = data["tool"] * _MM
    return robot


def main(campaign: str, result: str, residual: str) -> None:
    data = np.load(campaign)
    handler = OptimizationHandler(robot_of(data), kinematic_chain_mask=True)
    joints, positions = data["joints"], data["T"][:, :3, 3] * _MM

    def components(vector: np.ndarray) -> np.ndarray:
        handler.apply_optimization_vector(vector)
        away = [
            position_from_matrix(handler.robot.fk(q)) - p
            for q, p in zip(joints, positions, strict=True)
        ]
        return np.concatenate(away)

    start = handler.generate_optimization_vector()
    began = time.process_time()
    if residual == "norm":
        solved = least_squares(optimize_accuracy, start, args=(handler, joints, positions))
    else:
        solved = least_squares(components, start)
    cpu = time.process_time() - began
    handler.apply_optimization_vector(solved.x)
    predicted = [position_from_matrix(handler.robot.fk(q)) / _MM for q in data["held_out_joints"]]
    outcome = {
        "cpu_s": cpu,
        "parameters": len(start),
        "positions": np.array(predicted).tolist(),
    }
    Path(result).write_text(json.dumps(outcome))


if __name__ == "__main__":
    main(*sys.argv[1:])

"""Poses of the tool by pinocchio in a Python loop, per second of CPU time.

`python with_pinocchio.py CAMPAIGN.npz RESULT.json POSES ROUNDS`
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
import pinocchio as pin


def main(campaign: str, result: str, n_poses: str, rounds: str) -> None:
    data = np.load(campaign)
    model = pin.Model()
    parent, before = 0, 0.0
    for k, (alpha, a, _, d) in enumerate(data["craig"]):
        turn = pin.utils.rotate("x", alpha)
        placement = pin.SE3(turn, np.array([a, 0.0, before]))
        parent = model.addJoint(parent, pin.JointModelRZ(), placement, f"joint{k + 1}")
        before = d
    at_tool = pin.SE3(np.eye(3), data["tool"] + [0.0, 0.0, before])
    tool = model.addFrame(pin.Frame("tool", parent, 0, at_tool, pin.FrameType.OP_FRAME))
    state = model.createData()
    joints = np.random.default_rng(0).uniform(-np.pi, np.pi, (int(n_poses), 6))
    T = np.empty((len(joints), 4, 4))
    rates = []
    for _ in range(int(rounds)):
        began = time.process_time()
        for row, q in enumerate(joints):
            pin.forwardKinematics(model, state, q)
            T[row] = pin.updateFramePlacement(model, state, tool).homogeneous
        rates.append(len(joints) / (time.process_time() - began))
    Path(result).write_text(json.dumps({"rates": rates, "positions": T[:100, :3, 3].tolist()}))


if __name__ == "__main__":
    main(*sys.argv[1:])

"""Fit a campaign with robotkinecal: screw axes from the nominal frames on.

`python with_robotkinecal.py CAMPAIGN.npz RESULT.json positions|poses`
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
import roboticstoolbox as rtb
from robotkinecal import SerialRobotKineCal
from spatialmath import SE3


def robot_of(data: np.lib.npyio.NpzFile) -> rtb.Robot:
    """The nominal robot; each joint turns about the last elementary transform of its link."""
    links, parent, before = [], None, 0.0
    for alpha, a, _, d in data["craig"]:
        ets = rtb.ET.tz(before) * rtb.ET.Rx(alpha) * rtb.ET.tx(a) * rtb.ET.Rz()
        parent = rtb.Link(ets, name=f"link{len(links) + 1}", parent=parent)
        links.append(parent)
        before = d
    x, y, z = data["tool"] + [0.0, 0.0, before]
    links.append(rtb.Link(rtb.ET.tx(x) * rtb.ET.ty(y) * rtb.ET.tz(z), name="tool", parent=parent))
    return rtb.Robot(links)


def main(campaign: str, result: str, kind: str) -> None:
    data = np.load(campaign)
    np.random.seed(0)  # noqa: NPY002 - its bases are drawn from the global generator
    calibration = SerialRobotKineCal(robot_of(data), ee_name="tool")
    if kind == "poses":
        seen = [SE3(T, check=False) for T in data["T"]]
    else:
        seen = list(data["T"][:, :3, 3])
    began = time.process_time()
    calibration.set_observations(list(data["joints"]), seen)
    calibration.solve()
    cpu = time.process_time() - began
    last = calibration.N_JOINTS + 1
    predicted = [calibration.forward_kinematics(last, q).t for q in data["held_out_joints"]]
    outcome = {
        "cpu_s": cpu,
        "parameters": calibration.N_PARAMS,
        "positions": np.array(predicted).tolist(),
    }
    Path(result).write_text(json.dumps(outcome))


if __name__ == "__main__":
    main(*sys.argv[1:])

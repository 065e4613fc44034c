"""A robot learnt at one station is taken to another by base and tool alone."""

import json

from tests.robocal.diagnosis.hidden_cases import write_cases


def test_a_model_with_its_effects_fits_the_same_cell_stationed_anew(call, tmp_path):
    """The bundle is turned about by hand: the frames change, the robot does not."""
    hidden = ("--kind", "one", "--seed", "5", "--size", "3", "--effect", "joint_compliance")
    bundle = write_cases(tmp_path, *hidden) / "0000"
    assert call("diagnose", bundle, "--out", tmp_path / "a")[0] == 0
    table = bundle / "measurements.csv"
    header, *lines = table.read_text().splitlines()
    names = header.split(",")
    x, y = names.index("x_mm"), names.index("y_mm")
    turned = []
    for line in lines:
        cells = line.split(",")
        cells[x], cells[y] = f"{-float(cells[y]) + 500.0:.6f}", cells[x]
        turned.append(",".join(cells))
    table.write_text("\n".join([header, *turned]) + "\n")
    assert call("station", tmp_path / "a" / "model.yaml", bundle, "--out", tmp_path / "b")[0] == 0
    there = json.loads((tmp_path / "b" / "station.json").read_text())
    gain = json.loads((tmp_path / "a" / "diagnosis.json").read_text())["gain"]
    learnt = gain["held_out_rms_after_mm"]
    assert there["held_out"]["position_rms_mm"] < 1.1 * learnt < gain["held_out_rms_before_mm"]

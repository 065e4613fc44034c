"""A URDF that cannot be used is refused with its line."""

import pytest

from robocal.errors import BadInput
from robocal.formats.urdf import read_urdf

ARM = """<?xml version="1.0"?>
<robot name="arm">
  <link name="base"/><link name="a"/><link name="b"/>
  <joint name="first" type="revolute">
    <parent link="base"/><child link="a"/>
    <origin xyz="0 0 0.3" rpy="0 0 0"/>
    <axis xyz="0 0 1"/>
    <limit lower="-1" upper="1"/>
  </joint>
  <joint name="second" type="prismatic">
    <parent link="a"/><child link="b"/>
    <axis xyz="0 1 0"/>
    <limit lower="0" upper="0.5"/>
  </joint>
</robot>
"""


def complaint(tmp_path, text):
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    with pytest.raises(BadInput) as caught:
        read_urdf(path)
    return str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('xyz="0 0 0.3"', 'xyz="0 0"', "line 6: <origin> has xyz='0 0', not three numbers"),
        ('xyz="0 0 0.3"', 'xyz="0 0 nan"', "line 6: <origin> has xyz='0 0 nan', not three numbers"),
        ('xyz="0 0 1"', 'xyz="0 0 0"', "line 4: joint 'first' has a zero axis"),
        ('lower="-1"', 'lower="2"', "line 8: <limit> of 'first' has lower 2 not below upper 1"),
        ('lower="-1"', 'lower="low"', "line 8: <limit> of 'first' is no number"),
        ('type="prismatic"', 'type="planar"', "line 10: joint 'second' has type 'planar'"),
        ('<limit lower="0" upper="0.5"/>', "", "line 10: joint 'second' is prismatic and has no"),
        ('<parent link="a"/><child', "<child", "line 10: joint 'second' lacks parent or child"),
        ('<child link="b"/>', '<child link="a"/>', "line 11: <child> names 'a', the child of"),
        ('<parent link="a"/>', '<parent link="base"/>', "line 10: joint 'second' is a second bra"),
        ("</robot>", "</robo>", "line 15: is not XML: mismatched tag"),
        ("<robot ", '<!DOCTYPE robot [<!ENTITY a "b">]>\n<robot ', "line 2: has a document type"),
    ],
)
def test_a_spoilt_urdf_is_named_with_its_line(tmp_path, old, new, expected):
    assert old in ARM
    text = ARM.replace(old, new, 1)
    assert complaint(tmp_path, text).startswith(f"arm.urdf {expected}")


def test_a_urdf_without_motion_or_root_is_refused(tmp_path):
    assert "no moving joint" in complaint(
        tmp_path, ARM.replace('"revolute"', '"fixed"').replace('"prismatic"', '"fixed"')
    )
    assert "at the top" in complaint(tmp_path, ARM.replace("robot", "model"))
    assert "root link" in complaint(tmp_path, '<robot name="x"><link name="a"/></robot>')


def test_the_command_turns_a_urdf_into_a_robot(tmp_path, call):
    path = tmp_path / "arm.urdf"
    path.write_text(ARM)
    status, printed, _ = call("convert", path, "--format", "urdf", "--out", tmp_path / "robot")
    assert status == 0
    assert "arm: 2 joints" in printed
    text = (tmp_path / "robot" / "robot.yaml").read_text()
    assert "limits_mm: [0.0, 500.0]" in text

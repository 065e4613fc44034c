"""A campaign.yaml or robot.yaml that cannot be used: one line naming its line, status 2."""

import re

from tests.spoilt_bundle import (
    assert_refused,
    campaign,
    content,
    edit,
    parametrised,
    replaced,
    robot,
)

URDF_JOINT = """<robot name="a"><link name="l0"/><link name="l1"/>
<joint name="j" type="revolute"><parent link="l0"/><child link="l1"/><axis xyz="{axis}"/>
<limit lower="{lower}" upper="{upper}" effort="1" velocity="1"/></joint></robot>"""


YAML = {
    "tabs": (
        replaced("campaign.yaml", "gravity:", "\tgravity:"),
        "campaign.yaml line \\d: is not valid YAML",
    ),
    "duplicate key": (
        campaign("gravity: [0, 0, 1]"),
        "campaign.yaml line 5: field 'gravity' is twice",
    ),
    "unknown key": (
        campaign("gravitiy: [0, 0, 1]"),
        "campaign.yaml line 5: field 'gravitiy' is not known; did you mean 'gravity'",
    ),
    "unknown key deep down": (
        replaced("campaign.yaml", "sigma_ppm", "sigma_ppms"),
        "campaign.yaml line 3: field 'instrument.sigma_ppms' is not known.* mean 'sigma_ppm'",
    ),
    "negative sigma": (
        replaced("campaign.yaml", "sigma_mm: 0.015", "sigma_mm: -0.015"),
        "campaign.yaml line 3: field 'instrument.sigma_mm' must be positive",
    ),
    "sigma of zero": (
        replaced("campaign.yaml", "sigma_mm: 0.015", "sigma_mm: 0"),
        "campaign.yaml line 3: field 'instrument.sigma_mm' must be positive",
    ),
    "sigma whose square is zero": (
        replaced("campaign.yaml", "sigma_mm: 0.015", "sigma_mm: 1.0e-200"),
        "campaign.yaml line 3: field 'instrument.sigma_mm' must be positive, 1e-09 or more",
    ),
    "prior whose square is zero": (
        campaign("parameters: {prior_std: {a_2_mm: 1.0e-200}}"),
        "campaign.yaml line 5: field 'parameters.prior_std.a_2_mm' must be positive, 1e-09 or more",
    ),
    "sigma in words": (
        replaced("campaign.yaml", "sigma_mm: 0.015", "sigma_mm: small"),
        "campaign.yaml line 3: .*sigma_mm' must be a number, not 'small'",
    ),
    "sigma NaN": (
        replaced("campaign.yaml", "sigma_mm: 0.015", "sigma_mm: nan"),
        "campaign.yaml line 3: .*sigma_mm' must be a finite number",
    ),
    "no instrument": (
        replaced("campaign.yaml", "instrument:", "instruments:"),
        "campaign.yaml line 1: field 'instrument' is missing",
    ),
    "robot outside the folder": (
        replaced("campaign.yaml", "robot.yaml", "../robot.yaml"),
        "campaign.yaml line 1: field 'robot' must name a file beside",
    ),
    "absolute robot": (
        replaced("campaign.yaml", "robot.yaml", "/etc/passwd"),
        "campaign.yaml line 1: field 'robot' must name a file beside",
    ),
    "robot is the folder above": (
        replaced("campaign.yaml", "robot.yaml", ".."),
        "campaign.yaml line 1: field 'robot' must name a file beside",
    ),
    "robot is nothing": (
        replaced("campaign.yaml", "robot.yaml", "''"),
        "campaign.yaml line 1: field 'robot' must name a file beside",
    ),
    "robot is not there": (
        replaced("campaign.yaml", "robot.yaml", "other.yaml"),
        "other.yaml: no such file",
    ),
    "gravity of zero": (
        replaced("campaign.yaml", "[0, 0, -1]", "[0, 0, 0]"),
        "campaign.yaml line 4: field 'gravity' must not be zero",
    ),
    "gravity of two": (
        replaced("campaign.yaml", "[0, 0, -1]", "[0, -1]"),
        "campaign.yaml line 4: field 'gravity' must have 3 numbers",
    ),
    "more held out than there is": (
        campaign("held_out: {fraction: 1.5}"),
        "campaign.yaml line 5: field 'held_out.fraction' must be in",
    ),
    "negative seed": (
        campaign("held_out: {fraction: 0.2, seed: -1}"),
        "campaign.yaml line 5: field 'held_out.seed'",
    ),
    "broken seed": (
        campaign("held_out: {fraction: 0.2, seed: 1.5}"),
        "campaign.yaml line 5: field 'held_out.seed'",
    ),
    "split that is not there": (
        campaign("held_out: {column: split}"),
        "campaign.yaml line 5: .*'split', which measurements.csv lacks",
    ),
    "list for a file": (
        content("campaign.yaml", "- a\n- b\n"),
        "campaign.yaml line 1: the file must be a mapping",
    ),
    "empty campaign": (content("campaign.yaml", ""), "campaign.yaml: is empty"),
    "comment only": (content("campaign.yaml", "# nothing\n"), "campaign.yaml: is empty"),
    "two documents": (
        campaign("---\nrobot: robot.yaml"),
        "campaign.yaml line \\d: is not valid YAML",
    ),
    "binary campaign": (
        content("campaign.yaml", b"\xff\xfe\x00\x01" * 20),
        "campaign.yaml: is not UTF-8",
    ),
    "control characters": (
        content("campaign.yaml", "robot: \x01\x02"),
        "campaign.yaml.*: is not valid YAML",
    ),
    "unknown alias": (campaign("anchor: *nowhere"), "campaign.yaml line 5: is not valid YAML"),
    "alias to itself": (
        campaign("anchor: &a {xyz_mm: *a}"),
        "campaign.yaml line 5: field 'anchor.xyz_mm' must be a list",
    ),
    "aliases upon aliases": (
        content(
            "campaign.yaml",
            "a0: &a0 [1, 1]\n"
            + "".join(f"a{i}: &a{i} [*a{i - 1}, *a{i - 1}, *a{i - 1}]\n" for i in range(1, 60)),
        ),
        "campaign.yaml line \\d+: field",
    ),
    "deep nesting": (content("campaign.yaml", "robot: " + "[" * 20000), "campaign.yaml.*: "),
    "deep nesting that closes": (
        content("campaign.yaml", "robot: " + "[" * 5000 + "]" * 5000),
        "campaign.yaml.*: ",
    ),
    "deep mappings": (
        content("campaign.yaml", "\n".join(" " * i + f"a{i}:" for i in range(1500))),
        "campaign.yaml.*: ",
    ),
    "10 MB of YAML": (
        content("campaign.yaml", "robot: robot.yaml\n" + "# padding\n" * 1_000_000),
        "campaign.yaml: is larger than",
    ),
    "no campaign": (
        lambda folder: (folder / "campaign.yaml").unlink(),
        "campaign.yaml: no such file",
    ),
}
ROBOT = {
    "joint of no kind": (
        robot("type: revolute", "type: spherical"),
        "robot.yaml line 5: .*type' must be revolute or prismatic, not 'spherical'",
    ),
    "unknown convention": (
        robot("convention: mdh", "convention: dh"),
        "robot.yaml line 3: field 'convention' must be one of mdh, craig, urdf",
    ),
    "limits swapped": (
        robot("[-360, 360]", "[360, -360]"),
        "robot.yaml line 5: .*limits_deg' has its lower limit",
    ),
    "one limit": (
        robot("[-360, 360]", "[360]"),
        "robot.yaml line 5: .*limits_deg' must have 2 numbers",
    ),
    "length NaN": (
        robot("d_mm: 162.5", "d_mm: .nan"),
        "robot.yaml line 5: .*d_mm' must be a number|finite",
    ),
    "length in m": (
        robot("d_mm: 162.5", "d_m: 0.1625"),
        "robot.yaml line 5: .*d_m' is not known; did you mean 'd_mm'",
    ),
    "length of text": (
        robot("d_mm: 162.5", "d_mm: 162;5"),
        "robot.yaml line 5: .*d_mm' must be a number",
    ),
    "five masses": (
        edit("robot.yaml", lambda text: "\n".join(text.splitlines()[:-1])),
        "robot.yaml line .*'links' must have one entry a joint: 6, not 5",
    ),
    "no name": (
        edit("robot.yaml", lambda text: text.replace("name:", "label:")),
        "robot.yaml line .*'name' is missing",
    ),
    "robot of four joints": (
        edit("robot.yaml", lambda text: re.sub(r"(  - \{type.*\n){2}links:\n(.*\n)*", "", text)),
        "measurements.csv line 1: column 'j5_deg' is there, but robot .* has 4 joints",
    ),
    "robot of seven joints": (
        edit("robot.yaml", lambda text: re.sub(r"(  - \{type.*\n)links:\n(.*\n)*", r"\1\1", text)),
        "measurements.csv line 1: column 'j7_deg' is missing",
    ),
    "robot without joints": (
        content("robot.yaml", "name: a\njoints: []\n"),
        "robot.yaml line 2: field 'joints' must be a list with at least one entry",
    ),
    "URDF outside the folder": (
        content("robot.yaml", "name: a\nconvention: urdf\nurdf: ../a.urdf\n"),
        "robot.yaml line 3: field 'urdf' must name a file beside",
    ),
    "entities in a URDF": (
        lambda folder: [
            content("robot.yaml", "name: a\nconvention: urdf\nurdf: a.urdf\n")(folder),
            content("a.urdf", '<!DOCTYPE r [<!ENTITY a "aaaa">]><robot>&a;</robot>')(folder),
        ],
        "a.urdf line 1: .*document type",
    ),
    "axis of a URDF that points nowhere": (
        lambda folder: [
            content("robot.yaml", "name: a\nconvention: urdf\nurdf: a.urdf\n")(folder),
            content("a.urdf", URDF_JOINT.format(axis="0 0 0", lower=-1, upper=1))(folder),
        ],
        "a.urdf.*: .*'j'.*axis",
    ),
    "limits of a URDF swapped": (
        lambda folder: [
            content("robot.yaml", "name: a\nconvention: urdf\nurdf: a.urdf\n")(folder),
            content("a.urdf", URDF_JOINT.format(axis="0 0 1", lower=1, upper=-1))(folder),
        ],
        "a.urdf line 3: .*limit.*'j'",
    ),
    "limits of a URDF NaN": (
        lambda folder: [
            content("robot.yaml", "name: a\nconvention: urdf\nurdf: a.urdf\n")(folder),
            content("a.urdf", URDF_JOINT.format(axis="0 0 1", lower="nan", upper=1))(folder),
        ],
        "a.urdf line 3: .*limit.*'j'",
    ),
}


@parametrised(YAML)
def test_a_wrong_campaign_is_refused_by_line(call, bundle, tmp_path, spoil, complaint):
    spoil(bundle)
    assert_refused(call, bundle, tmp_path / "out", complaint)


@parametrised(ROBOT)
def test_a_wrong_robot_is_refused_by_line(call, bundle, tmp_path, spoil, complaint):
    spoil(bundle)
    assert_refused(call, bundle, tmp_path / "out", complaint)

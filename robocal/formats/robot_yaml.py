"""`robot.yaml`: the nominal robot, in MDH or Craig's convention or by a URDF file."""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.formats.fields import Fields, read_fields
from robocal.formats.urdf import read_urdf
from robocal.frames import frame_from_xyz_ypr, xyz_ypr_from_frame
from robocal.kinematics.model import KinematicModel
from robocal.robots.from_axes import links_from_frames
from robocal.robots.robot import LinkMass, Robot

_DEG = np.pi / 180.0
_CONVENTIONS = ("mdh", "craig", "urdf")


def read_robot(path: Path) -> Robot:
    """A robot from its file.

    Raises
    ------
    BadInput
        If the file does not follow the contract; names line and field.
    """
    fields = read_fields(path)
    robot = robot_from_fields(fields, path.parent)
    fields.finish()
    return robot


def robot_from_fields(fields: Fields, folder: Path) -> Robot:
    """A robot from an open mapping; a URDF file is looked for in `folder`."""
    name = fields.text("name")
    convention = fields.text("convention", "mdh")
    if convention not in _CONVENTIONS:
        raise fields.error("convention", f"must be one of {', '.join(_CONVENTIONS)}")
    if convention == "urdf":
        _refuse_masses(fields)
        robot = read_urdf(folder / plain_file_name(fields, "urdf"))
        return Robot(name, robot.geometry, robot.limits)
    rows = fields.mappings("joints")
    kinds, links, limits = zip(*(_joint(row) for row in rows), strict=True)
    prismatic = np.array([kind == "prismatic" for kind in kinds])
    table = np.array(links)
    geometry = KinematicModel(
        table, prismatic, mount=_constant(fields, "mount"), flange=_constant(fields, "flange")
    )
    if convention == "craig":
        _refuse_masses(fields)
        geometry = _from_craig(table, prismatic)
    return Robot(name, geometry, np.array(limits), _masses(fields, len(rows)))


def plain_file_name(fields: Fields, name: str) -> str:
    """A file name without folders, so that a bundle cannot reach outside itself."""
    file = fields.text(name)
    if file in ("", "..") or file != Path(file).name or "\\" in file:
        raise fields.error(name, f"must name a file beside this one, not '{file}'")
    return file


def _joint(row: Fields) -> tuple[str, list[float], tuple[float, ...]]:
    kind = row.text("type")
    if kind not in ("revolute", "prismatic"):
        raise row.error("type", f"must be revolute or prismatic, not '{kind}'")
    link = [
        row.number("theta_deg", 0.0) * _DEG,
        row.number("d_mm", 0.0) * 1e-3,
        row.number("a_mm", 0.0) * 1e-3,
        row.number("alpha_deg", 0.0) * _DEG,
        row.number("beta_deg", 0.0) * _DEG,
    ]
    name, unit, default = (
        ("limits_mm", 1e-3, (0.0, 1000.0))
        if kind == "prismatic"
        else ("limits_deg", _DEG, (-180.0, 180.0))
    )
    low, high = row.numbers(name, 2) if name in row else default
    if low >= high:
        raise row.error(name, f"has its lower limit {low:g} not below its upper limit {high:g}")
    row.finish()
    return kind, link, (low * unit, high * unit)


def _from_craig(table: Float[Array, "joint 5"], prismatic: Bool[Array, "joint"]) -> KinematicModel:
    """MDH links of rows in Craig's order, Rx(alpha) Tx(a) Rz(theta) Tz(d), beta after."""
    frames, T = [], np.eye(4)
    for theta, d, a, alpha, beta in table:
        before, after = np.eye(4), np.eye(4)
        before[1:3, 1:3] = [[np.cos(alpha), -np.sin(alpha)], [np.sin(alpha), np.cos(alpha)]]
        before[0, 3] = a
        T = T @ before
        frames.append(T)
        after[:2, :2] = [[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]]
        after[2, 3] = d
        tilt = np.eye(4)
        tilt[0, 0] = tilt[2, 2] = np.cos(beta)
        tilt[0, 2], tilt[2, 0] = np.sin(beta), -np.sin(beta)
        T = T @ after @ tilt
    links, mount, flange = links_from_frames(np.array(frames), T)
    return KinematicModel(links, prismatic, mount=mount, flange=flange)


def _constant(fields: Fields, name: str) -> Float[Array, "4 4"]:
    """An optional constant frame before (`mount`) or after (`flange`) the links."""
    if name not in fields:
        return np.eye(4)
    frame = fields.mapping(name)
    values = read_frame(frame)
    frame.finish()
    return frame_from_xyz_ypr(values)


def _refuse_masses(fields: Fields) -> None:
    """Centres of mass are given in the frames of the file's own convention, which are not kept."""
    if "links" in fields:
        raise fields.error("links", "is understood with convention mdh only; remove it")


def _masses(fields: Fields, n_joints: int) -> tuple[LinkMass, ...] | None:
    if "links" not in fields:
        return None
    rows = fields.mappings("links")
    if len(rows) != n_joints:
        raise fields.error("links", f"must have one entry a joint: {n_joints}, not {len(rows)}")
    masses = []
    for row in rows:
        x, y, z = (value * 1e-3 for value in row.numbers("com_mm", 3))
        mass = row.number("mass_kg")
        if mass < 0:
            raise row.error("mass_kg", "must not be negative")
        row.finish()
        masses.append(LinkMass(mass, (x, y, z)))
    return tuple(masses)


def robot_document(robot: Robot) -> dict[str, object]:
    """`robot.yaml` of a robot in MDH form."""
    joints = [
        {
            "type": "prismatic" if slides else "revolute",
            **link_document(link),
            "limits_mm" if slides else "limits_deg": [
                float(value) / (1e-3 if slides else _DEG) for value in limits
            ],
        }
        for link, slides, limits in zip(
            robot.geometry.links, robot.geometry.prismatic, robot.limits, strict=True
        )
    ]
    document: dict[str, object] = {"name": robot.name, "convention": "mdh", "joints": joints}
    for name, frame in (("mount", robot.geometry.mount), ("flange", robot.geometry.flange)):
        if not np.array_equal(frame, np.eye(4)):
            document[name] = frame_document(frame)
    if robot.masses:
        document["links"] = [
            {"mass_kg": link.mass, "com_mm": [c * 1e3 for c in link.centre]}
            for link in robot.masses
        ]
    return document


def link_document(link: Float[Array, "5"]) -> dict[str, float]:
    """Five MDH parameters in file units."""
    theta, d, a, alpha, beta = (float(value) for value in link)
    return {
        "theta_deg": theta / _DEG,
        "d_mm": d * 1e3,
        "a_mm": a * 1e3,
        "alpha_deg": alpha / _DEG,
        "beta_deg": beta / _DEG,
    }


def frame_document(T: Float[Array, "4 4"]) -> dict[str, list[float]]:
    """A frame as `xyz_mm` and `ypr_deg`."""
    frame = xyz_ypr_from_frame(T)
    return {
        "xyz_mm": [float(value) * 1e3 for value in frame[:3]],
        "ypr_deg": [float(value) / _DEG for value in frame[3:]],
    }


def read_frame(fields: Fields) -> Float[Array, "6"]:
    """x, y, z [m], yaw, pitch, roll [rad] from `xyz_mm` and `ypr_deg`."""
    xyz, ypr = fields.numbers("xyz_mm", 3), fields.numbers("ypr_deg", 3)
    return np.concatenate([np.array(xyz) * 1e-3, np.array(ypr) * _DEG])

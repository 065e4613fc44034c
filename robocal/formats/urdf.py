"""Robots described in URDF: the one chain of joints from the root link to the only tip."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.errors import BadInput
from robocal.formats.fields import read_text
from robocal.formats.joint_origins import frame_from_xyz_rpy, geometry_of
from robocal.formats.robot_import import ImportedRobot, RobotOptions
from robocal.robots.robot import Robot

_MOVING = ("revolute", "continuous", "prismatic")
_LINE = "line of the file"


def read_urdf(path: Path) -> Robot:
    """The serial chain of a URDF file as MDH links.

    Fixed joints are folded into the geometry. `origin rpy` turns about fixed axes x, y, z, which is
    yaw, pitch, roll in our order.

    Raises
    ------
    BadInput
        If the file is no URDF, the joints branch, or a joint type cannot be handled.
    """
    file = path.name
    root = _parse(file, read_text(path))
    if root.tag != "robot":
        raise BadInput(file, f"must have <robot> at the top, not <{root.tag}>")
    frames, prismatic, limits = [], [], []
    T = np.eye(4)
    for joint in _chain(root, file):
        T = T @ _origin(joint, file)
        kind = joint.get("type", "")
        if kind == "fixed":
            continue
        if kind not in _MOVING:
            raise _error(file, joint, f"has type '{kind}'; use one of {', '.join(_MOVING)}")
        axis = _triple(joint.find("axis"), "xyz", (1.0, 0, 0), file)
        if not axis.any():
            raise _error(file, joint, "has a zero axis")
        frames.append(T @ _turn_z_to(axis))
        prismatic.append(kind == "prismatic")
        limits.append(_limits(joint, kind, file))
    if not frames:
        raise BadInput(file, "has no moving joint")
    geometry = geometry_of(np.array(frames), T, np.array(prismatic))
    return Robot(root.get("name", path.stem), geometry, np.array(limits))


def import_urdf(path: Path, options: RobotOptions) -> ImportedRobot:
    """A robot from URDF, under another name if one is given."""
    robot = read_urdf(path)
    notes = ("URDF's masses, shapes and mimic joints were left out",)
    return ImportedRobot(replace(robot, name=options.name or robot.name), notes)


def _parse(file: str, text: str) -> ElementTree.Element:
    """The tree of an XML text, with the line of every element."""
    builder = ElementTree.TreeBuilder()
    parser = expat.ParserCreate()

    def start(tag: str, attributes: dict[str, str]) -> None:
        builder.start(tag, attributes | {_LINE: str(parser.CurrentLineNumber)})

    def refuse(*_: object) -> None:
        raise BadInput(f"{file} line {parser.CurrentLineNumber}", "has a document type; remove it")

    parser.StartElementHandler = start
    parser.EndElementHandler = builder.end
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(text, True)  # noqa: FBT003
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise BadInput(f"{file} line {error.lineno}", f"is not XML: {reason}") from None
    root: ElementTree.Element = builder.close()
    return root


def _error(file: str, element: ElementTree.Element, reason: str) -> BadInput:
    """A complaint about a joint or something in it."""
    name = element.get("name")
    what = f"{element.tag} '{name}'" if name else f"<{element.tag}>"
    return BadInput(f"{file} line {element.get(_LINE)}", f"{what} {reason}")


def _chain(root: ElementTree.Element, file: str) -> list[ElementTree.Element]:
    """Joints in order from the root link; branches of fixed joints only are left aside."""
    by_parent: dict[str, list[ElementTree.Element]] = {}
    children = set()
    for joint in root.findall("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        if parent is None or child is None:
            raise _error(file, joint, "lacks parent or child")
        by_parent.setdefault(parent.get("link", ""), []).append(joint)
        if child.get("link") in children:
            raise _error(file, child, f"names '{child.get('link')}', the child of another joint")
        children.add(child.get("link"))
    roots = [link for link in by_parent if link not in children]
    if len(roots) != 1:
        raise BadInput(file, f"must have one root link, found {len(roots)}")
    chain: list[ElementTree.Element] = []
    link = roots[0]
    while link in by_parent:
        branches = [(joint, _moving_below(joint, by_parent)) for joint in by_parent[link]]
        most = max(count for _, count in branches)
        moving = [joint for joint, count in branches if count > 0]
        if len(moving) > 1:
            reason = f"is a second branch at link '{link}'; only serial arms can be calibrated"
            raise _error(file, moving[1], reason)
        joint = next(joint for joint, count in branches if count == most)
        chain.append(joint)
        link = _child(joint)
    return chain


def _moving_below(
    joint: ElementTree.Element, by_parent: dict[str, list[ElementTree.Element]]
) -> int:
    """Number of moving joints from `joint` on."""
    below = by_parent.get(_child(joint), [])
    own = int(joint.get("type") in _MOVING)
    return own + sum(_moving_below(following, by_parent) for following in below)


def _child(joint: ElementTree.Element) -> str:
    child = joint.find("child")
    return "" if child is None else child.get("link", "")


def _triple(
    element: ElementTree.Element | None,
    name: str,
    default: tuple[float, float, float],
    file: str,
) -> Float[Array, "3"]:
    if element is None or element.get(name) is None:
        return np.array(default, dtype=float)
    text = element.get(name, "")
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        raise _error(file, element, f"has {name}='{text}', not three numbers") from None
    if values.shape != (3,) or not np.isfinite(values).all():
        raise _error(file, element, f"has {name}='{text}', not three numbers")
    return values


def _origin(joint: ElementTree.Element, file: str) -> Float[Array, "4 4"]:
    origin = joint.find("origin")
    xyz = _triple(origin, "xyz", (0.0, 0.0, 0.0), file)
    return frame_from_xyz_rpy(xyz, _triple(origin, "rpy", (0.0, 0.0, 0.0), file))


def _turn_z_to(axis: Float[Array, "3"]) -> Float[Array, "4 4"]:
    """A rotation that brings z onto `axis`."""
    z = axis / np.linalg.norm(axis)
    start = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = start - z * (z @ start)
    x /= np.linalg.norm(x)
    T = np.eye(4)
    if z[2] != 1.0:
        T[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    return T


def _limits(joint: ElementTree.Element, kind: str, file: str) -> tuple[float, float]:
    limit = joint.find("limit")
    if kind == "continuous" or (limit is None and kind == "revolute"):
        return (-2 * np.pi, 2 * np.pi)
    if limit is None:
        raise _error(file, joint, "is prismatic and has no <limit>")
    try:
        lower, upper = float(limit.get("lower", "0")), float(limit.get("upper", "0"))
    except ValueError:
        raise _error(file, limit, f"of '{joint.get('name')}' is no number") from None
    if not lower < upper:
        reason = f"of '{joint.get('name')}' has lower {lower:g} not below upper {upper:g}"
        raise _error(file, limit, reason)
    return lower, upper

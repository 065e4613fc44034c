"""Robots described in URDF: the one chain of joints from the root link to the only tip."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.errors import BadInput
from robocal.formats.fields import read_text
from robocal.frames import frame_from_xyz_ypr
from robocal.kinematics.model import KinematicModel
from robocal.robots.from_axes import links_from_frames
from robocal.robots.robot import Robot

_MOVING = ("revolute", "continuous", "prismatic")


def read_urdf(path: Path) -> Robot:
    """The serial chain of a URDF file as MDH links.

    Fixed joints are folded into the geometry. `origin rpy` turns about fixed axes x, y, z, which is
    yaw, pitch, roll in our order.

    Raises
    ------
    BadInput
        If the file is no URDF, the joints branch, or a joint type cannot be handled.
    """
    text = read_text(path)
    if "<!ENTITY" in text or "<!DOCTYPE" in text:
        raise BadInput(path.name, "has a document type with entities; remove it")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise BadInput(f"{path.name} line {error.position[0]}", f"is not XML: {error}") from None
    if root.tag != "robot":
        raise BadInput(path.name, f"must have <robot> at the top, not <{root.tag}>")
    frames, prismatic, limits = [], [], []
    T = np.eye(4)
    for joint in _chain(root, path.name):
        T = T @ _origin(joint, path.name)
        kind = joint.get("type", "")
        if kind == "fixed":
            continue
        if kind not in _MOVING:
            raise BadInput(
                path.name, f"joint '{joint.get('name')}' has type '{kind}'; use one of {_MOVING}"
            )
        frames.append(T @ _turn_z_to(_triple(joint.find("axis"), "xyz", (1.0, 0, 0), path.name)))
        prismatic.append(kind == "prismatic")
        limits.append(_limits(joint, kind, path.name))
    if not frames:
        raise BadInput(path.name, "has no moving joint")
    links, mount, flange = links_from_frames(np.array(frames), T)
    geometry = KinematicModel(links, np.array(prismatic), mount=mount, flange=flange)
    return Robot(root.get("name", path.stem), geometry, np.array(limits))


def _chain(root: ElementTree.Element, file: str) -> list[ElementTree.Element]:
    """Joints in order from the root link; branches of fixed joints only are left aside."""
    by_parent: dict[str, list[ElementTree.Element]] = {}
    children = set()
    for joint in root.findall("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        if parent is None or child is None:
            raise BadInput(file, f"joint '{joint.get('name')}' lacks parent or child")
        by_parent.setdefault(parent.get("link", ""), []).append(joint)
        if child.get("link") in children:
            raise BadInput(file, f"link '{child.get('link')}' is the child of two joints")
        children.add(child.get("link"))
    roots = [link for link in by_parent if link not in children]
    if len(roots) != 1:
        raise BadInput(file, f"must have one root link, found {len(roots)}")
    chain: list[ElementTree.Element] = []
    link = roots[0]
    while link in by_parent:
        branches = [(joint, _moving_below(joint, by_parent)) for joint in by_parent[link]]
        most = max(count for _, count in branches)
        if most > 0 and sum(count > 0 for _, count in branches) > 1:
            raise BadInput(file, f"branches at link '{link}'; only serial arms can be calibrated")
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
        raise BadInput(file, f"{name}='{text}' is not three numbers") from None
    if values.shape != (3,) or not np.isfinite(values).all():
        raise BadInput(file, f"{name}='{text}' is not three numbers")
    return values


def _origin(joint: ElementTree.Element, file: str) -> Float[Array, "4 4"]:
    origin = joint.find("origin")
    rpy = _triple(origin, "rpy", (0.0, 0.0, 0.0), file)
    return frame_from_xyz_ypr(
        np.concatenate([_triple(origin, "xyz", (0.0, 0.0, 0.0), file), rpy[::-1]])
    )


def _turn_z_to(axis: Float[Array, "3"]) -> Float[Array, "4 4"]:
    """A rotation that brings z onto `axis`."""
    z = axis / np.linalg.norm(axis)
    start = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = start - z * (z @ start)
    x /= np.linalg.norm(x)
    T = np.eye(4)
    if not np.allclose(z, (0, 0, 1)):
        T[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    return T


def _limits(joint: ElementTree.Element, kind: str, file: str) -> tuple[float, float]:
    limit = joint.find("limit")
    if kind == "continuous" or limit is None:
        return (-2 * np.pi, 2 * np.pi)
    try:
        return float(limit.get("lower", "0")), float(limit.get("upper", "0"))
    except ValueError:
        raise BadInput(
            file, f"joint '{joint.get('name')}' has limits that are no numbers"
        ) from None

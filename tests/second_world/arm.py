"""An arm: frames by elementary rotations, weights, and the torques that these bring about.

Inside the second world metre, radian, second and newton are used throughout.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

G = 9.80665
N = 6
"""Joints."""


@dataclass(frozen=True)
class Arm:
    """Rows of theta, d, a, alpha, beta, and for each link its mass and centre in its own frame."""

    links: np.ndarray
    limits: np.ndarray
    mass: np.ndarray
    centre: np.ndarray


def read_arm(path: Path) -> Arm:
    """Read robot.yaml."""
    document = yaml.safe_load(path.read_text())
    joints, links = document["joints"], document["links"]
    angles = ("theta_deg", "alpha_deg", "beta_deg")
    theta, alpha, beta = (np.deg2rad([j.get(name, 0.0) for j in joints]) for name in angles)
    d, a = (np.array([j[name] for j in joints]) * 1e-3 for name in ("d_mm", "a_mm"))
    return Arm(
        np.stack([theta, d, a, alpha, beta], axis=1),
        np.deg2rad([j["limits_deg"] for j in joints]),
        np.array([link["mass_kg"] for link in links]),
        np.array([link["com_mm"] for link in links]) * 1e-3,
    )


def rotation(axis: int, angle: np.ndarray | float) -> np.ndarray:
    """Rotations about one axis of coordinates."""
    angle = np.asarray(angle, dtype=float)
    R = np.zeros((*angle.shape, 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R[..., axis, axis] = 1.0
    R[..., i, i] = R[..., j, j] = np.cos(angle)
    R[..., j, i] = np.sin(angle)
    R[..., i, j] = -np.sin(angle)
    return R


def turn(w: np.ndarray) -> np.ndarray:
    """Rotations by vectors; Rodrigues."""
    t = np.linalg.norm(w, axis=-1)[..., None, None]
    K = np.zeros((*w.shape[:-1], 3, 3))
    K[..., 0, 1], K[..., 0, 2], K[..., 1, 2] = -w[..., 2], w[..., 1], -w[..., 0]
    K[..., 1, 0], K[..., 2, 0], K[..., 2, 1] = w[..., 2], -w[..., 1], w[..., 0]
    # sin(t)/t and (1 - cos t)/t^2, also where t is nothing.
    return np.eye(3) + np.sinc(t / np.pi) * K + 0.5 * np.sinc(t / (2 * np.pi)) ** 2 * (K @ K)


def applied(R: np.ndarray, v: np.ndarray) -> np.ndarray:
    """R v, row by row."""
    return np.einsum("nij,nj->ni", R, v)


def frames(
    links: np.ndarray,
    q: np.ndarray,
    growth: np.ndarray,
    bent: dict[int, tuple[np.ndarray, np.ndarray]],
) -> tuple[np.ndarray, np.ndarray]:
    """Axes and origins of the base and of all links: Rz Tz Tx Rx Ry.

    Parameters
    ----------
    links
        Theta, d, a, alpha, beta.
    q
        Joint angles, row by row.
    growth
        Of d and a of every link, as a share of them, row by row.
    bent
        Turn and shift of a link's end in its own frame; from 0.
    """
    R, o = np.zeros((len(q), N + 1, 3, 3)), np.zeros((len(q), N + 1, 3))
    R[:, 0] = np.eye(3)
    for link, (theta, d, a, alpha, beta) in enumerate(links):
        turned = R[:, link] @ rotation(2, q[:, link] + theta)
        longer = (1.0 + growth[:, link])[:, None]
        here = o[:, link] + longer * (d * turned[..., 2] + a * turned[..., 0])
        turned = turned @ rotation(0, alpha) @ rotation(1, beta)
        if link in bent:
            angle, sag = bent[link]
            here, turned = here + applied(turned, sag), turned @ turn(angle)
        R[:, link + 1], o[:, link + 1] = turned, here
    return R, o


def moment_about(
    point: np.ndarray, place: np.ndarray, mass: np.ndarray, down: np.ndarray, first: int
) -> np.ndarray:
    """Moment of the weights of all bodies from one on about points."""
    force = mass[:, first:, None] * G * down
    return np.cross(place[:, first:] - point[:, None], force).sum(axis=1)


def torques(
    R: np.ndarray, o: np.ndarray, place: np.ndarray, mass: np.ndarray, down: np.ndarray
) -> np.ndarray:
    """Of gravity about every joint's axis, which is z of the frame before it."""
    return np.stack(
        [
            np.einsum("ni,ni->n", R[:, j, :, 2], moment_about(o[:, j], place, mass, down, j))
            for j in range(N)
        ],
        axis=1,
    )

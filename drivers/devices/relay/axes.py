"""From a tracker's axes to right-handed ones: which signed axis of the line is our x, y, z."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

NAMES = ("x", "y", "z")
Quaternion = tuple[float, float, float, float]


@dataclass(frozen=True)
class Axes:
    """A signed permutation of three axes.

    Raises
    ------
    ValueError
        If the names are not x, y and z once each, with or without a minus.
    """

    names: tuple[str, ...]

    def __post_init__(self) -> None:
        """Refuse what is no set of axes."""
        if sorted(name.lstrip("-+") for name in self.names) != list(NAMES):
            raise ValueError(f"axes must be x, y and z with signs, not {', '.join(self.names)}")

    @property
    def mirrors(self) -> bool:
        """Whether the line's axes are left-handed."""
        order = [NAMES.index(name.lstrip("-+")) for name in self.names]
        swaps = sum(order[i] > order[j] for i in range(3) for j in range(i + 1, 3))
        signs = sum(name.startswith("-") for name in self.names)
        return (swaps + signs) % 2 == 1

    def point(self, line: Sequence[float]) -> tuple[float, float, float]:
        """Turn a point's coordinates in the line into ours."""
        x, y, z = (
            (-1.0 if name.startswith("-") else 1.0) * line[NAMES.index(name.lstrip("-+"))]
            for name in self.names
        )
        return x, y, z

    def orientation(self, line: Quaternion) -> Quaternion:
        """Turn an orientation in the line's axes into ours: only the reference changes."""
        return _product(self._turn(), line)

    def _turn(self) -> Quaternion:
        """Give this permutation as a quaternion, from the matrix whose rows are our axes."""
        rows = [self.point([float(i == j) for i in range(3)]) for j in range(3)]
        m = [[rows[j][i] for j in range(3)] for i in range(3)]
        squares = (
            1.0 + m[0][0] + m[1][1] + m[2][2],
            1.0 + m[0][0] - m[1][1] - m[2][2],
            1.0 - m[0][0] + m[1][1] - m[2][2],
            1.0 - m[0][0] - m[1][1] + m[2][2],
        )
        w, x, y, z = (math.sqrt(max(square, 0.0)) / 2.0 for square in squares)
        if w > 0.0:
            return (
                w,
                math.copysign(x, m[2][1] - m[1][2]),
                math.copysign(y, m[0][2] - m[2][0]),
                math.copysign(z, m[1][0] - m[0][1]),
            )
        # Half a turn: the signs follow from the products of the axis' components.
        if x > 0.0:
            return w, x, math.copysign(y, m[0][1]), math.copysign(z, m[0][2])
        return w, x, y, math.copysign(z, m[1][2])


def _product(a: Quaternion, b: Quaternion) -> Quaternion:
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )

"""Measured rows: joints, what the instrument saw there, and the circumstances."""

from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array


@dataclass(frozen=True)
class MeasurementSet:
    """Observations in file order; NaN where a value is missing. SI units and radians.

    Parameters
    ----------
    lines
        Line of the file that each row came from.
    joints
        Joint readings [rad], [m] for prismatic joints.
    position
        Target in the measuring frame [m].
    orientation
        Quaternion w, x, y, z of the target in the measuring frame, normalised.
    distance
        Length from the anchor to the target [m].
    pose
        Number of the pose; repeats of one pose share it.
    target
        Name of the nest, empty for the tool itself.
    held_out
        True for rows that take no part in a fit.
    time, temperature, payload, speed, settle
        [s], [degC], [kg], fraction of full speed, [s].
    approach
        Direction in which each joint last moved: -1, 0, 1.
    commanded
        Joints that were asked for [rad or m].
    """

    lines: Int[Array, "row"]
    joints: Float[Array, "row joint"]
    position: Float[Array, "row 3"]
    orientation: Float[Array, "row 4"]
    distance: Float[Array, "row"]
    pose: Int[Array, "row"]
    target: tuple[str, ...]
    held_out: Bool[Array, "row"]
    time: Float[Array, "row"]
    temperature: Float[Array, "row"]
    payload: Float[Array, "row"]
    speed: Float[Array, "row"]
    settle: Float[Array, "row"]
    approach: Float[Array, "row joint"]
    commanded: Float[Array, "row joint"]

    def __len__(self) -> int:
        return len(self.lines)

    @property
    def has_orientation(self) -> Bool[Array, "row"]:
        """Rows with a full pose."""
        return np.asarray(np.isfinite(self.orientation[:, 0]))

    @property
    def visit(self) -> Int[Array, "row"]:
        """A number for every row; repeats share it: one pose, nest, payload and approach."""
        nest = np.unique(np.array(self.target, dtype=str), return_inverse=True)[1]
        circumstances = np.column_stack([
            self.pose,
            nest.ravel(),
            np.nan_to_num(self.payload),
            np.nan_to_num(self.approach),
        ])
        return np.asarray(np.unique(circumstances, axis=0, return_inverse=True)[1]).ravel()

    def rows(self, choice: Bool[Array, "row"] | Int[Array, "_"]) -> "MeasurementSet":
        """Some of the rows, by mask or number."""
        chosen: dict[str, object] = {
            field.name: getattr(self, field.name)[choice]
            for field in fields(self)
            if field.name != "target"
        }
        chosen["target"] = tuple(np.array(self.target, dtype=object)[choice].tolist())
        return replace(self, **chosen)  # type: ignore[arg-type]

    @property
    def fit_rows(self) -> "MeasurementSet":
        """The rows that a fit may use."""
        return self.rows(~self.held_out)

    @property
    def held_out_rows(self) -> "MeasurementSet":
        """The rows that no fit may use."""
        return self.rows(self.held_out)


def approach_column(joint: int) -> str:
    """Name of the column of a joint's (from 1) direction of approach."""
    return f"approach{joint}"


def unmeasured_rows(
    joints: Float[Array, "row joint"],
    payload: float = float("nan"),
    temperature: float = float("nan"),
) -> MeasurementSet:
    """Rows of joints that nobody has measured yet, numbered from 1, come to from neither side.

    Parameters
    ----------
    joints
        Where the robot is going to be [rad or m].
    payload, temperature
        Of all rows [kg], [degC]; NaN where nobody knows.
    """
    n, nothing = len(joints), np.full(len(joints), np.nan)
    return MeasurementSet(
        lines=np.arange(1, n + 1),
        joints=joints,
        position=np.full((n, 3), np.nan),
        orientation=np.full((n, 4), np.nan),
        distance=nothing,
        pose=np.arange(n),
        target=("",) * n,
        held_out=np.zeros(n, dtype=bool),
        time=nothing,
        temperature=np.full(n, temperature),
        payload=np.full(n, payload),
        speed=nothing,
        settle=nothing,
        approach=np.zeros(joints.shape),
        commanded=np.full(joints.shape, np.nan),
    )

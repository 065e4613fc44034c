"""The chosen poses as a list of visits: order, direction of approach, payload, repeats.

With two payloads all visits of one come before those of the other, so that the load is changed
once. The repeats of a payload follow its first visits: time lies between the visits of one pose, so
that their scatter holds what a campaign's scatter holds.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.planning.factors import approach_directions, payload_halves, repeated_poses
from robocal.planning.order import duration, shortest_order, travel_times
from robocal.planning.pose_rows import PoseRows
from robocal.planning.request import PlanRequest


@dataclass(frozen=True)
class Visits:
    """One entry a visit, in order."""

    q: Float[Array, "visit joint"]
    """[rad or m]"""
    pose: Int[Array, "visit"]
    """Number of the pose, from 1 in order of first visits."""
    repeat: Int[Array, "visit"]
    """1 at the first visit of a pose, 2 at the second ..."""
    approach: Int[Array, "visit joint"] | None
    """Direction from which each joint comes: 1 rising, -1 falling."""
    payload: Float[Array, "visit"] | None
    """[kg]"""
    travel_time: float
    """Of the joint moves alone [s]."""


def arrange_visits(
    request: PlanRequest,
    rows: PoseRows,
    candidates: Float[Array, "candidate joint"],
    chosen: Int[Array, "chosen"],
) -> Visits:
    """Visits of the chosen candidates, as the request wants them.

    Returns
    -------
    Visits
        Its first pose is the first of the chosen; each stretch of the order is short by
        `order.shortest_order`.
    """
    q = candidates[chosen]
    further = repeated_poses(rows.J, chosen, request.further_visits)
    part = np.zeros(len(chosen), dtype=int)
    payloads = request.cell.payloads
    if payloads is not None:
        part = payload_halves(rows.J, chosen, request.seed)
    times = travel_times(rows.model, q, request.speed)
    sequence, repeat = _sequence(part, further, times)
    number = np.empty(len(chosen), dtype=int)
    number[sequence[repeat == 1]] = np.arange(1, len(chosen) + 1)
    approach = approach_directions(rows, chosen, request.seed) if request.with_approach else None
    return Visits(
        q=q[sequence],
        pose=number[sequence],
        repeat=repeat,
        approach=None if approach is None else approach[sequence],
        payload=None if payloads is None else np.array(payloads)[part[sequence]],
        travel_time=duration(sequence, times),
    )


def _sequence(
    part: Int[Array, "chosen"], further: Int[Array, "chosen"], times: Float[Array, "chosen chosen"]
) -> tuple[Int[Array, "visit"], Int[Array, "visit"]]:
    """Pose of every visit, and which visit of that pose it is."""
    order: list[int] = []
    repeat: list[int] = []
    for half in range(2):
        for visit in range(int(further.max(initial=0)) + 1):
            there = np.flatnonzero((part == half) & (further >= visit))
            if len(there):
                order.extend(_stretch(there, times, order[-1] if order else int(there[0])))
                repeat.extend([visit + 1] * len(there))
    return np.array(order), np.array(repeat)


def _stretch(there: Int[Array, "some"], times: Float[Array, "pose pose"], start: int) -> list[int]:
    """Some poses in short order, begun at the one nearest to `start`."""
    first = int(np.argmin(times[start, there]))
    order = shortest_order(times[np.ix_(there, there)], first)
    return [int(pose) for pose in there[order]]

"""The way to a pose, judged before anything moves: by limits, floor, box and the arm itself."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.planning.cell import Cell
from robocal.planning.detour import find_way
from robocal.planning.path import path_is_clear
from robocal.robots.robot import Robot
from service.procedures.sides import Sides

Joints = tuple[float, ...]


@dataclass(frozen=True)
class NextVisit:
    """The pose and repeat to be measured next."""

    idx: int
    repeat: int
    commanded: Joints


@dataclass(frozen=True)
class Route:
    """How the robot is to go to a pose."""

    start: Joints
    stops: tuple[Joints, ...]
    """The pose is the last one; none where the pose is not to be driven to."""
    sides: tuple[int, ...] | None
    """Direction of each joint's last move; None where the way decides it."""
    refusal: str
    """Why it is not to be driven to; empty otherwise."""


@dataclass(frozen=True)
class Judge:
    """What decides over every motion of a campaign."""

    robot: Robot
    """With the joint limits of its cell."""
    cell: Cell
    sides: Sides

    def route(self, start: Joints, visit: NextVisit, stances: Sequence[Joints]) -> Route:
        """Find a way that keeps every bound, with the sides stated for the visit.

        Where those leave no room, all joints come from the other side.

        Parameters
        ----------
        start
            Where the robot stands [rad or m].
        stances
            Postures that may serve as a stop on the way.
        """
        here, pose = np.array(start), np.array(visit.commanded)
        if not self.sides.stated:
            return self._onto(here, pose, None, stances)
        signs = self.sides.of(visit.idx, visit.repeat, pose)
        route = self._onto(here, pose, signs, stances)
        if route.stops:
            return route
        other = self._onto(here, pose, -signs, stances)
        return other if other.stops else route

    def _onto(
        self,
        here: Float[Array, "joint"],
        pose: Float[Array, "joint"],
        signs: Float[Array, "joint"] | None,
        stances: Sequence[Joints],
    ) -> Route:
        first = pose if signs is None else self.sides.before(pose, signs)
        last = path_is_clear(self.robot, first, pose, self.cell)
        start = _joints(here)
        if not last:
            return Route(start, (), None, f"not driven: into the pose {last.sentence}")
        way = find_way(self.robot, here, first, self.cell, [np.array(q) for q in stances])
        if not way.stops:
            sentence = f"not driven: {way.check.sentence}, and no detour is free"
            return Route(start, (), None, sentence)
        stops = way.stops if signs is None else (*way.stops, pose)
        sides = None if signs is None else tuple(int(sign) for sign in signs)
        return Route(start, tuple(_joints(stop) for stop in stops), sides, "")


def _joints(q: Float[Array, "joint"]) -> Joints:
    return tuple(float(value) for value in q)

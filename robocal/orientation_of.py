"""Whose orientation a wanted pose states."""

from enum import StrEnum


class OrientationOf(StrEnum):
    """`flange`: of a flange whose tool is where the pose's position says."""

    tool = "tool"
    flange = "flange"

"""What can become of a wanted pose; without the numerics, for whoever only reads the answer."""

from enum import StrEnum


class Reach(StrEnum):
    """Whether a wanted pose was reached."""

    reached = "reached"
    outside_limits = "outside_limits"
    """Met, but by joints beyond their limits, and full turns do not help."""
    singular = "singular"
    """The pose, or the nominal one, is singular: it is met by large turns of joints, or missed by
    no more than a geometry error."""
    other_configuration = "other_configuration"
    """Met, but with shoulder, elbow or wrist on the other side than with the nominal joints."""
    not_reached = "not_reached"
    """The arm does not come there."""

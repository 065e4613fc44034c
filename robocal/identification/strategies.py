"""The identification strategies by name."""

from robocal.identification.cross import identify_crosswise
from robocal.identification.simultaneous import identify_simultaneously
from robocal.identification.strategy import Strategy

STRATEGIES: dict[str, Strategy] = {
    "simultaneous": identify_simultaneously,
    "cross": identify_crosswise,
}

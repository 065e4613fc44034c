"""What became of a campaign or a touch whose device was spoilt."""

from dataclasses import dataclass

LASTING = 100_000
"""Replies that are spoilt, more than a campaign has."""


@dataclass(frozen=True)
class Outcome:
    """What became of one campaign."""

    word: str
    """recovered, paused and resumed, or what went wrong."""
    sentence: str
    lost: int
    wrong: int
    moving: int

    @property
    def survived(self) -> bool:
        """Whether all readings are there and right, and the robot stood still in every pause."""
        good = self.word in {"recovered", "resumed"}
        return good and not (self.lost or self.wrong or self.moving)

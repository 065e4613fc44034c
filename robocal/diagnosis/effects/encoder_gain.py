"""A joint's reading is off by a factor.

delta q_j = g q_j: a gear ratio configured wrongly, or a gain of the encoder.
"""

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import (
    Coefficient,
    Follows,
    Instance,
    Moves,
    column,
    theta,
)

PRIOR = 2e-4
"""1e-5 to 5e-4 where a ratio is configured wrongly; [1]"""


class EncoderGain:
    """A joint's reading is off by a factor."""

    name = "encoder_gain"
    follows = Follows.angle
    advice = "check the gear ratio in the controller's configuration and the encoder's line count"
    needs = ""

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        return [
            Instance(self.name, joint, (), (Coefficient("gain", PRIOR),))
            for joint in range(1, rows.n_joints + 1)
        ]

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        assert instance.joint is not None
        return {theta(instance.joint, rows): column(rows.joints[:, instance.joint - 1])}

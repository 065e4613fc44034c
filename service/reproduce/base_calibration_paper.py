"""What document 001 prints: robots, touches, readings and tables 2 to 5, errors corrected.

Source: Zhong et al., Manufacturing Technology & Machine Tool 12 (2022), 20-26. The 6R arm's table
is not printed. The one here puts the needle where table 3 has it, and its shoulder and wrist
lengths are those that the shifts between tables 2 and 3 allow (0.85, 0.37 and 0.34 m, each within
about 0.1 m, by least squares over the eight rows).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.base_calibration.arm import Arm
from robocal.frames import frame_from_xyz_ypr
from robocal.kinematics.model import KinematicModel

_QUARTER = np.pi / 2
_ARM = np.array([
    [0.0, 0.40, 0.80, -_QUARTER, 0.0],
    [0.0, 0.0, 1.25, 0.0, 0.0],
    [0.0, 0.0, 0.0, -_QUARTER, 0.0],
    [0.0, 0.65, 0.0, _QUARTER, 0.0],
    [0.0, 0.0, 0.0, -_QUARTER, 0.0],
    [0.0, 0.35, 0.0, 0.0, 0.0],
])
_SCARA = np.array([
    [0.0, 0.5, 0.4, 0.0, 0.0],
    [0.0, 0.0, 0.3, 0.0, 0.0],
    [0.0, -0.2, 0.0, 0.0, 0.0],
    [0.0, 0.0, 0.0, 0.0, 0.0],
])
_TURN = np.array([-np.pi, np.pi])


def arm() -> Arm:
    """The 6R master."""
    return Arm(KinematicModel(_ARM, np.zeros(6, dtype=bool)), np.tile(_TURN, (6, 1)))


def scara() -> Arm:
    """The RRPR slave."""
    limits = np.array([_TURN, _TURN, [-0.2, 0.2], _TURN])
    return Arm(KinematicModel(_SCARA, np.array([False, False, True, False])), limits)


@dataclass(frozen=True)
class Printed:
    """One row of tables 2, 4 and 5: an experiment at one amplitude.

    Parameters
    ----------
    master, slave
        Table 2: joints at P1, P2 and at R1, R2, typing errors corrected [rad].
    angles
        Table 4: alpha_x, beta_y, gamma_z [rad].
    first, second
        Table 4: P_x1, P_y1, P_z1 and P_x2, P_y2, P_z2 [m].
    e_rot, e_tran
        Table 5 [rad], [m].
    """

    amplitude: float
    master: Float[Array, "2 6"]
    slave: Float[Array, "2 4"]
    points: Float[Array, "4 3"]
    """Table 3: P1, P2, R1, R2 [m]."""
    angles: tuple[float, float, float]
    first: tuple[float, float, float]
    second: tuple[float, float, float]
    e_rot: float
    e_tran: float


@dataclass(frozen=True)
class Experiment:
    """One of the two simulated cells."""

    number: int
    master_turn: float
    """Joint 1 at P1; minus it at P2 [rad]."""
    slave_turn: float
    """Minus joint 1 at R1; joint 1 at R2 [rad]."""
    slave_origin: tuple[float, float, float]
    travel: float
    """E [m]."""
    printed: tuple[Printed, Printed]

    @property
    def transform(self) -> Float[Array, "4 4"]:
        """The slave's base in the master's; turned by -90 deg, as the numbers have it."""
        return frame_from_xyz_ypr(np.array([*self.slave_origin, -_QUARTER, 0.0, 0.0]))

    @property
    def master_joints(self) -> Float[Array, "2 6"]:
        """At P1 and P2."""
        bent = [-_QUARTER, 0.0, 0.0, _QUARTER, 0.0]
        return np.array([[self.master_turn, *bent], [-self.master_turn, *bent]])

    @property
    def slave_joints(self) -> Float[Array, "2 4"]:
        """At R1 and R2."""
        return np.array([[-self.slave_turn, 0.0, 0.0, 0.0], [self.slave_turn, 0.0, 0.0, 0.0]])


def _joints(turn: tuple[float, float], q2: tuple[float, float], q5: tuple[float, float]) -> Array:
    """Two rows of the master in table 2."""
    rows = zip(turn, q2, q5, strict=True)
    return np.array([[first, second, 0.0, 0.0, fifth, 0.0] for first, second, fifth in rows])


def _slave(first: float, second: float) -> Array:
    """Two rows of the slave in table 2."""
    return np.array([[first, 0.0, 0.0, 0.0], [second, 0.0, 0.0, 0.0]])


EXPERIMENTS = (
    Experiment(
        1,
        0.6283,
        0.4488,
        (4.0, -1.0, 1.0),
        3.8822,
        (
            Printed(
                0.1,
                _joints((0.6283, -0.6283), (-1.5708, -1.5707), (1.5709, 1.5708)),
                _slave(-0.4488, 0.4488),
                np.array([
                    [1.1731, 0.8523, 1.3],
                    [1.1731, -0.8523, 1.3],
                    [0.6307, -0.3037, 0.3],
                    [0.6306, 0.3037, 0.3],
                ]),
                (0.0, 0.0001, 1.5708),
                (4.0, -1.0, 1.0),
                (4.0, -1.0001, 1.0002),
                1.0e-4,
                1.4e-4,
            ),
            Printed(
                0.5,
                _joints((0.6283, -0.6284), (-1.5711, -1.5710), (1.5711, 1.5705)),
                _slave(-0.4488, 0.4488),
                np.array([
                    [1.1728, 0.8520, 1.3002],
                    [1.1730, -0.8524, 1.3002],
                    [0.6307, -0.3037, 0.3],
                    [0.6307, 0.3037, 0.3],
                ]),
                (0.0001, 0.0001, 1.5707),
                (3.9999, -0.9997, 1.0002),
                (4.0, -1.0, 1.0001),
                1.7e-4,
                2.2e-4,
            ),
        ),
    ),
    Experiment(
        2,
        1.0472,
        0.6283,
        (6.0, -4.0, 1.0),
        5.9093,
        (
            Printed(
                0.1,
                _joints((1.0472, -1.0472), (-1.5708, -1.5709), (1.5707, 1.5708)),
                _slave(-0.6283, 0.6284),
                np.array([
                    [0.7250, 1.2558, 1.3],
                    [0.7250, -1.2557, 1.3001],
                    [0.5663, -0.4115, 0.3],
                    [0.5663, 0.4115, 0.3],
                ]),
                (0.0001, 0.0, 1.5707),
                (5.9999, -4.0001, 1.0001),
                (6.0, -4.0, 1.0),
                1.4e-4,
                1.4e-4,
            ),
            Printed(
                0.5,
                _joints((1.0470, -1.0472), (-1.5706, -1.5709), (1.5711, 1.5712)),
                _slave(-0.6283, 0.6284),
                np.array([
                    [0.7253, 1.2558, 1.3],
                    [0.7249, -1.2555, 1.3001],
                    [0.5663, -0.4115, 0.3],
                    [0.5663, 0.4115, 0.3],
                ]),
                (0.0002, 0.0003, 1.5709),
                (5.9996, -3.9998, 1.0001),
                (5.9997, -4.0002, 1.0002),
                5.4e-4,
                3.6e-4,
            ),
        ),
    ),
)
"""Both experiments. The matrix of experiment 2 has (6, -4, 1); its text says (5, -2, 1)."""

PAPER_ERRORS = (
    "The slave is turned by -90 deg about Z, not +90: the stage readings agree with the touch "
    "points only so (to 1.5e-5 m and 2e-5 rad). Table 3 gives the SCARA's gamma with the "
    "wrong sign.",
    "E is printed with a minus sign.",
    "Experiment 2: the text's offset is (5, -2, 1), the matrix's (6, -4, 1). Its stage readings "
    "belong to experiment 1's touch angles; here they are computed from the model.",
    "Table 2, experiment 1, amplitude 0.5, P2 joint 2: 1.571 0 for -1.571 0.",
    "Table 2, experiment 2, amplitude 0.5: P2 joint 2 -1.750 9 for -1.570 9, R1 joint 1 "
    "-0.618 3 for -0.628 3.",
    "Eq. (4) swaps gamma and alpha; eq. (3) lost terms in its third column.",
    "Section 2.5, |O1e|: printed with O1P1, the triangle has O1P2 (the same length in both "
    "experiments). |R1R2| and |O2R2| are printed with the coordinates of R1 twice.",
    "The side views are left to the reader (`likewise`). Taken literally they divide by zero, "
    "because P1 and P2 coincide in X-Z and R1 and R2 in Y-Z; alpha and beta are no polar "
    "angles there.",
    "Eq. (12) is uniform and proportional to the angle, not Gaussian; zero angles get no noise.",
)

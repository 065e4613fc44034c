"""Base-to-base registration: from touches to the transform, its uncertainty and what it lacks."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.base_calibration.corrections import CORRECTIONS, N_CORRECTIONS
from robocal.base_calibration.faults import StageFault, examine, visible_columns
from robocal.base_calibration.next_touch import Pair, Proposal, Travel, best_next_touch
from robocal.base_calibration.open_directions import OpenDirection, open_directions, slave_null
from robocal.base_calibration.solution import Solution
from robocal.base_calibration.stage import Stage
from robocal.base_calibration.touches import Touches
from robocal.base_calibration.unit_slips import unit_slip
from robocal.errors import NoAnswer
from robocal.frames import xyz_ypr_from_frame

_SEEN = 5.0
"""A fault is found 95 times in 100 when it changes the whitened residuals by this much; [1]"""
_IDENTIFIED = 0.5
"""A correction counts as identified when the touches halve its prior uncertainty; [1]"""


@dataclass(frozen=True)
class SensorCorrection:
    """What the touches say of one sensor correction [SI].

    Parameters
    ----------
    status
        `identified`, `prior` (the touches say less than the prior) or `fixed`.
    found_from
        Smallest fault that would be found 95 times in 100; infinite where it is hidden.
    base_shift
        How far the slave's base moves for a fault of the usual size that stays unknown [m].
    """

    name: str
    value: float
    std: float
    status: str
    found_from: float
    base_shift: float

    @property
    def hidden(self) -> bool:
        """No fault of the usual size would be seen, and the touches do not tell its value."""
        usual = {correction.name: correction.fault_std for correction in CORRECTIONS}
        return self.status != "identified" and self.found_from > usual[self.name]


@dataclass(frozen=True)
class Registration:
    """Where the slave stands in the master's base, and how sure that is."""

    solution: Solution
    touches: Touches
    """Those used."""
    stage: Stage
    """As used: wide priors for corrections that were found faulty."""
    faults: tuple[StageFault, ...]
    rejected: tuple[int, ...]
    undetermined: tuple[OpenDirection, ...]
    corrections: tuple[SensorCorrection, ...]
    next_touch: Proposal | None

    @property
    def transform(self) -> Float[Array, "4 4"]:
        """The slave's base in the master's base."""
        return self.solution.state.slave

    @property
    def covariance(self) -> Float[Array, "6 6"]:
        """Of shift [m] and rotation vector [rad] in the master's axes; open directions left out."""
        slave = self.solution.state.slave_columns
        return self.solution.covariance[slave, slave]

    @property
    def std(self) -> Float[Array, "6"]:
        """Standard uncertainty of x, y, z, yaw, pitch, roll; infinite where undetermined."""
        J = _ypr_rates(self.transform)
        std = np.sqrt(np.diag(J @ self.covariance @ J.T))
        loose = np.abs(J @ slave_null(self.solution)).max(axis=1, initial=0.0)
        return np.asarray(np.where(loose > 1e-6, np.inf, std))

    @property
    def residual_rms(self) -> float:
        """Of tip less cup, length of the vector [m]."""
        squares = (self.solution.equations.misclosure**2).sum(axis=1)
        return float(np.sqrt(squares.mean()))

    @property
    def p_value(self) -> float:
        """Chance of so large a weighted sum of squares if model and uncertainties are right."""
        from scipy.special import gammaincc

        nu = self.solution.nu
        return float(gammaincc(nu / 2.0, self.solution.chi_square / 2.0)) if nu > 0 else 1.0


def register(
    touches: Touches, stage: Stage, travel: Travel | None = None, pair: Pair | None = None
) -> Registration:
    """Weighted least squares over both robots' touches and all three sensors.

    Parameters
    ----------
    touches
        At least two by each robot.
    stage
        Sensor uncertainties, levels and priors of the corrections.
    travel, pair
        For the proposals of further touches: the stage's ranges and both robots, whose columns
        are also tried in other units where nothing fits.

    Raises
    ------
    NoAnswer
        With fewer touches, in wrong units, or if the iteration does not settle.
    """
    for robot, count in (("master", (~touches.by_slave).sum()), ("slave", touches.by_slave.sum())):
        if count < 2:
            raise NoAnswer(f"{count} touches by the {robot}; each robot must touch at least twice")
    slip = None if pair is None else unit_slip(touches, stage, pair)
    if slip is not None:
        raise NoAnswer(f"the touches fit only if {slip}; convert the touches to the columns' units")
    ranges = Travel() if travel is None else travel
    found = examine(touches, stage)
    return Registration(
        found.solution,
        found.touches,
        found.stage,
        found.faults,
        found.rejected,
        open_directions(found.solution, found.touches, ranges),
        _corrections(found.solution, found.stage),
        best_next_touch(found.solution, found.touches, found.stage, ranges, pair),
    )


def _ypr_rates(T: Float[Array, "4 4"]) -> Float[Array, "6 6"]:
    """Change of x, y, z, yaw, pitch, roll by shift and rotation vector in outer axes."""
    yaw, pitch = xyz_ypr_from_frame(T)[3:5]
    after_yaw = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    side = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    roll_axis = np.cos(pitch) * after_yaw - np.sin(pitch) * np.eye(3)[2]
    axes = np.column_stack([np.eye(3)[2], side, roll_axis])
    J = np.eye(6)
    # At pitch 90 deg yaw and roll turn about one line; each alone is then as good as unknown.
    J[3:, 3:] = np.linalg.pinv(axes, rcond=1e-12)
    return J


def _corrections(solution: Solution, stage: Stage) -> tuple[SensorCorrection, ...]:
    visible = np.linalg.norm(visible_columns(solution), axis=0)
    columns = solution.equations.J[:, -N_CORRECTIONS:].copy()
    columns[solution.equations.n_coordinates :] = 0.0
    slave = solution.state.slave_columns
    shifts = np.linalg.norm((solution.inverse @ columns)[slave][:3], axis=0)
    std = np.sqrt(np.diag(solution.covariance)[-N_CORRECTIONS:])
    entries = []
    for k, correction in enumerate(CORRECTIONS):
        if stage.prior_std[k] == 0.0:
            status = "fixed"
        else:
            informed = std[k] <= _IDENTIFIED * stage.prior_std[k]
            status = "identified" if informed else "prior"
        seen = visible[k] * correction.fault_std
        entries.append(
            SensorCorrection(
                correction.name,
                float(solution.state.corrections[k]),
                float(std[k]),
                status,
                float(_SEEN * correction.fault_std / seen) if seen > 1e-6 else np.inf,
                float(shifts[k] * correction.fault_std),
            )
        )
    return tuple(entries)

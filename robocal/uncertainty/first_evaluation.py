"""The first statement of uncertainty after an identification: covariance and Monte Carlo."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.calibrated import CalibratedRobot
from robocal.identification.adequacy import Adequacy
from robocal.uncertainty.monte_carlo import (
    COVERAGE,
    DRAWS,
    ToolPositionDraws,
    draw_tool_positions,
)


@dataclass(frozen=True)
class FirstEvaluation:
    """Uncertainty of the tool's position at the measured poses."""

    q: Float[Array, "pose joint"]
    propagated_std: Float[Array, "pose 3"]
    """By the law of propagation, from the covariance [m]."""
    draws: ToolPositionDraws
    n_draws: int
    seed: int


def evaluate_first(
    calibrated: CalibratedRobot,
    q: Float[Array, "pose joint"],
    draws: int = DRAWS,
    seed: int = 1,
) -> FirstEvaluation:
    """Tool uncertainty at joint readings `q`, by both ways.

    Both speak of the parameters as the declared instrument noise leaves them: effects that the
    model does not know are not in these figures.
    """
    covariance = calibrated.tool_position_covariance(q)
    propagated = np.sqrt(np.einsum("mii->mi", covariance))
    drawn = draw_tool_positions(calibrated.model, calibrated.covariance, q, draws, seed)
    return FirstEvaluation(q, propagated, drawn, draws, seed)


def uncertainty_document(
    evaluation: FirstEvaluation, lines: Array, adequacy: Adequacy
) -> dict[str, object]:
    """`uncertainty.json`: each measured pose with its standard and expanded uncertainty in mm."""
    propagated = np.linalg.norm(evaluation.propagated_std, axis=1)
    drawn = np.linalg.norm(evaluation.draws.std, axis=1)
    return {
        "method": "covariance of the identified parameters; Monte Carlo of the tool position",
        "draws": evaluation.n_draws,
        "seed": evaluation.seed,
        "coverage": COVERAGE,
        "tool_position": {
            "u_propagated_rms_mm": _rms(propagated) * 1e3,
            "u_monte_carlo_rms_mm": _rms(drawn) * 1e3,
            "U95_mean_mm": float(evaluation.draws.radius.mean()) * 1e3,
            "U95_max_mm": float(evaluation.draws.radius.max()) * 1e3,
            "largest_difference": float(np.max(np.abs(drawn / propagated - 1.0))),
        },
        "poses": [
            {
                "line": int(line),
                "u_mm": [float(value) * 1e3 for value in std],
                "u_propagated_mm": [float(value) * 1e3 for value in by_law],
                "U95_mm": float(radius) * 1e3,
            }
            for line, std, by_law, radius in zip(
                lines,
                evaluation.draws.std,
                evaluation.propagated_std,
                evaluation.draws.radius,
                strict=True,
            )
        ],
        "reduced_chi_square": adequacy.reduced_chi_square if adequacy.nu > 0 else None,
        "degrees_of_freedom": adequacy.nu,
        "adequate": adequacy.adequate,
    }


def _rms(values: Float[Array, "pose"]) -> float:
    return float(np.sqrt(np.mean(values**2)))

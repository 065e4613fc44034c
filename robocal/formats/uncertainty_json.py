"""`uncertainty.json`: an evaluation of uncertainty in file units."""

from dataclasses import asdict

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.calibrated import UNKNOWN_BASE_ROTATION, UNKNOWN_ROTATION
from robocal.identification.result import AXES_OF_STD
from robocal.uncertainty.evaluation import Evaluation, RefitCheck
from robocal.uncertainty.propagation import COVERAGE
from robocal.uncertainty.refit_verdict import judge_refits
from robocal.uncertainty.repeats import Scatter
from robocal.uncertainty.verdict import Verdict
from robocal.uncertainty.workspace_map import WorkspaceMap

_DEG = np.pi / 180.0
_MM = 1e-3
_MRAD = 1e-3


def uncertainty_document(
    evaluation: Evaluation, lines: Int[Array, "pose"], workspace: WorkspaceMap | None = None
) -> dict[str, object]:
    """The document.

    Parameters
    ----------
    evaluation
        Of an identification.
    lines
        Line of the file that each pose came from.
    workspace
        Map, where one was made.
    """
    adequacy = evaluation.result.adequacy
    return {
        "method": "law of propagation (GUM) from the budget; Monte Carlo (JCGM 101) beside it",
        "draws": evaluation.check.sampled.n_draws,
        "seed": evaluation.settings.seed,
        "coverage": COVERAGE,
        "intervals": _intervals(evaluation.verdict),
        "reduced_chi_square": adequacy.reduced_chi_square if adequacy.nu > 0 else None,
        "degrees_of_freedom": adequacy.nu,
        "adequate": adequacy.adequate,
        "type_a": {
            "position": _scatter(evaluation.repeats.position, "mm"),
            "orientation": _scatter(evaluation.repeats.orientation, "mrad"),
        },
        "budget": _budget(evaluation),
        "frame_axes": dict(AXES_OF_STD),
        "parameters": _parameters(evaluation),
        "tool_position": _tool_position(evaluation),
        "monte_carlo": _monte_carlo(evaluation),
        "refits": None if evaluation.refits is None else _refits(evaluation, evaluation.refits),
        "rejected_rows": [asdict(row) for row in evaluation.result.rejected],
        "tool_rotation": {
            "known": evaluation.result.tool_rotation_known,
            "sentence": None if evaluation.result.tool_rotation_known else UNKNOWN_ROTATION,
        },
        "base_rotation": {
            "known": evaluation.result.base_rotation_known,
            "sentence": None if evaluation.result.base_rotation_known else UNKNOWN_BASE_ROTATION,
        },
        "poses": _poses(evaluation, lines),
        "workspace": None if workspace is None else _workspace(workspace),
    }


def _intervals(verdict: Verdict) -> dict[str, object]:
    return {
        "hold": verdict.hold,
        "sentence": verdict.sentence,
        "reasons": list(verdict.reasons),
    }


def _scatter(scatter: Scatter | None, unit: str) -> dict[str, object] | None:
    if scatter is None:
        return None
    return {
        f"s_{unit}": scatter.std * 1e3,
        "degrees_of_freedom": scatter.nu,
        "variance_over_declared": scatter.ratio,
        "p_value": scatter.chance,
        "contradicts_declared": scatter.contradicts,
    }


def _budget(evaluation: Evaluation) -> list[dict[str, object]]:
    """One line a source: what it does to the tool at the evaluated poses (root mean square)."""
    tool = evaluation.tool
    variance = np.einsum("mii->m", tool.covariance[:, :3, :3])
    own = np.sqrt((tool.shares * variance[:, None]).mean(axis=0))
    total = float(variance.mean())
    return [
        {
            "source": source.name,
            "type": source.evaluated.value,
            "stated": source.stated,
            "degrees_of_freedom": _finite(source.nu),
            "u_tool_mm": float(value) / _MM,
            "share": float(value) ** 2 / total if total > 0 else 0.0,
        }
        for source, value in zip(evaluation.sources, own, strict=True)
    ]


def _parameters(evaluation: Evaluation) -> list[dict[str, object]]:
    result, found = evaluation.result, evaluation.parameters
    names, is_angle = result.cell.names, result.cell.is_angle
    rows: list[dict[str, object]] = []
    for index in result.free:
        unit = _DEG if is_angle[index] else _MM
        rows.append({
            "name": names[index],
            "unit": "deg" if is_angle[index] else "mm",
            "u": float(found.std[index]) / unit,
            "U95": float(found.expanded[index]) / unit,
            "degrees_of_freedom": _finite(float(found.nu[index])),
            "status": result.status(names[index]).value,
            "shares": {
                source.name: float(share)
                for source, share in zip(evaluation.sources, found.shares[index], strict=True)
            },
        })
    return rows


def _tool_position(evaluation: Evaluation) -> dict[str, object]:
    radius = evaluation.tool.radius
    propagated = np.linalg.norm(evaluation.tool.position_std, axis=1)
    check = evaluation.check
    drawn = np.linalg.norm(check.sampled.std.reshape(-1, 3), axis=1)
    ratio = drawn / np.maximum(propagated[check.poses], 1e-300)
    return {
        "u_propagated_rms_mm": _rms(propagated) / _MM,
        "u_monte_carlo_rms_mm": _rms(drawn) / _MM,
        "U95_mean_mm": float(radius.mean()) / _MM,
        "U95_max_mm": float(radius.max()) / _MM,
        "largest_difference": float(np.abs(ratio - 1.0).max()),
    }


def _monte_carlo(evaluation: Evaluation) -> dict[str, object]:
    check = evaluation.check
    sampled, agreement = check.sampled, check.agreement
    validated = agreement.validated
    return {
        "poses": [int(pose) for pose in check.poses],
        "draws": sampled.n_draws,
        "drawn_from": "refits" if check.by_refits else "distribution of the parameters",
        "digits": evaluation.settings.digits,
        "stable": sampled.stable,
        "share_of_tolerance": evaluation.settings.share,
        "gum_validated": bool(validated.all()),
        "gum_validated_share": float(validated.mean()),
        "largest_distance_over_tolerance": float(
            (np.maximum(agreement.low, agreement.high) / _positive(agreement.tolerance)).max()
        ),
        "u_mm": _triples(sampled.std),
        "symmetric_low_mm": _triples(sampled.symmetric.low),
        "symmetric_high_mm": _triples(sampled.symmetric.high),
        "shortest_low_mm": _triples(sampled.shortest.low),
        "shortest_high_mm": _triples(sampled.shortest.high),
        "U95_mm": [float(value) / _MM for value in check.radius],
    }


def _refits(evaluation: Evaluation, refits: RefitCheck) -> dict[str, object]:
    result = evaluation.result
    names, is_angle = result.cell.names, result.cell.is_angle
    rows = []
    for index in result.free:
        unit = _DEG if is_angle[index] else _MM
        row: dict[str, object] = {"name": names[index], "unit": "deg" if is_angle[index] else "mm"}
        for key, values in (
            ("u", refits.std),
            ("bias", refits.bias),
            ("symmetric_low", refits.symmetric.low),
            ("symmetric_high", refits.symmetric.high),
            ("shortest_low", refits.shortest.low),
            ("shortest_high", refits.shortest.high),
        ):
            row[key] = float(values[index]) / unit
        rows.append(row)
    verdict = judge_refits(evaluation, refits)
    return {
        "count": refits.count,
        "unsettled": refits.n_unsettled,
        "agree": verdict.agree,
        "sentence": verdict.sentence,
        "parameters": rows,
    }


def _poses(evaluation: Evaluation, lines: Int[Array, "pose"]) -> list[dict[str, object]]:
    tool, turned = evaluation.tool, evaluation.result.tool_rotation_known
    return [
        {
            "line": int(line),
            "u_mm": [float(value) / _MM for value in position],
            "u_rotation_mrad": [float(value) / _MRAD for value in turn] if turned else None,
            "U95_mm": float(radius) / _MM,
            "degrees_of_freedom": _finite(float(nu)),
        }
        for line, position, turn, radius, nu in zip(
            lines, tool.position_std, tool.orientation_std, tool.radius, tool.nu, strict=True
        )
    ]


def _workspace(found: WorkspaceMap) -> dict[str, object]:
    return {
        "frame": "robot base",
        "edge_mm": found.edge / _MM,
        "cubes": [
            {
                "centre_mm": [float(value) / _MM for value in centre],
                "poses": int(poses),
                "U95_mean_mm": float(mean) / _MM,
                "U95_max_mm": float(largest) / _MM,
            }
            for centre, poses, mean, largest in zip(
                found.centre, found.poses, found.mean, found.largest, strict=True
            )
        ],
    }


def _finite(nu: float) -> float | None:
    """Degrees of freedom; None stands for infinitely many."""
    return None if np.isinf(nu) else nu


def _triples(values: Float[Array, "output"]) -> list[list[float]]:
    return [[float(value) / _MM for value in triple] for triple in values.reshape(-1, 3)]


def _positive(values: Float[Array, "output"]) -> Float[Array, "output"]:
    return np.asarray(np.maximum(values, 1e-300))


def _rms(values: Float[Array, "pose"]) -> float:
    return float(np.sqrt(np.mean(values**2)))

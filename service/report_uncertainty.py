"""What an evaluation of uncertainty says to a person at a terminal."""

from pathlib import Path

import numpy as np

from robocal.calibrated import UNKNOWN_BASE_ROTATION, UNKNOWN_ROTATION
from robocal.uncertainty.evaluation import Evaluation
from robocal.uncertainty.refit_verdict import judge_refits
from robocal.uncertainty.workspace_map import WorkspaceMap
from service.report_lines import not_used_lines


def uncertainty_lines(evaluation: Evaluation, workspace: WorkspaceMap, out: Path) -> list[str]:
    """The budget, the tool, the checks, and whether to believe it."""
    tool, check = evaluation.tool, evaluation.check
    variance = np.einsum("mii->m", tool.covariance[:, :3, :3])
    shares = (tool.shares * variance[:, None]).mean(axis=0) / max(float(variance.mean()), 1e-300)
    lines = [f"{'source':46}{'type':>5}{'stated':>26}{'nu':>7}{'share':>8}"]
    for source, share in zip(evaluation.sources, shares, strict=True):
        nu = "inf" if np.isinf(source.nu) else f"{source.nu:.0f}"
        lines.append(
            f"{source.name:46}{source.evaluated.value:>5}{source.stated:>26}{nu:>7}{share:8.1%}"
        )
    radius = tool.radius * 1e3
    way = "refits" if check.by_refits else "draws"
    lines += [
        f"tool position, {len(radius)} poses: U95 mean {radius.mean():.4f} mm, "
        f"max {radius.max():.4f} mm",
        f"over the workspace: U95 mean {workspace.mean.mean() * 1e3:.4f} mm, "
        f"max {workspace.largest.max() * 1e3:.4f} mm",
        f"Monte Carlo: {check.sampled.n_draws} {way}, {_stability(evaluation)}; "
        f"law of propagation validated for {check.agreement.validated.mean():.0%} of "
        f"{len(check.agreement.low)} coordinates",
    ]
    if evaluation.refits is not None:
        lines.append(judge_refits(evaluation, evaluation.refits).sentence)
    if not evaluation.result.tool_rotation_known:
        lines.append(f"no uncertainty of orientations is stated: {UNKNOWN_ROTATION}")
    if not evaluation.result.base_rotation_known:
        lines.append(f"uncertainties leave the base's turn aside: {UNKNOWN_BASE_ROTATION}")
    lines += not_used_lines(evaluation.result.rejected)
    lines += [evaluation.verdict.sentence, f"-> {out / 'uncertainty.json'}"]
    return lines


def _stability(evaluation: Evaluation) -> str:
    if evaluation.settings.draws is not None:
        return "as many as asked for, their stability not judged"
    settings = evaluation.settings
    met = f"{settings.share:g} of the numerical tolerance of {settings.digits} digit(s)"
    if evaluation.check.sampled.stable:
        return f"stable to {met}"
    return f"not yet stable to {met} at the most allowed"

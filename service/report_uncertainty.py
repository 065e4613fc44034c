"""What an evaluation of uncertainty says to a person at a terminal."""

from pathlib import Path

import numpy as np

from robocal.uncertainty.evaluation import Evaluation
from robocal.uncertainty.workspace_map import WorkspaceMap


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
        f"Monte Carlo: {check.sampled.n_draws} {way}, "
        f"{'stable' if check.sampled.stable else 'stability not reached or not asked for'}; "
        f"law of propagation validated for {check.agreement.validated.mean():.0%} of "
        f"{len(check.agreement.low)} coordinates",
    ]
    if evaluation.refits is not None:
        lines.append(_refit_line(evaluation))
    lines += [evaluation.verdict.sentence, f"-> {out / 'uncertainty.json'}"]
    return lines


def _refit_line(evaluation: Evaluation) -> str:
    refits = evaluation.refits
    assert refits is not None
    result = evaluation.result
    stated = evaluation.parameters.std
    kept = [k for k in result.free if result.cell.names[k] not in result.reasons and stated[k] > 0]
    ratio = refits.std[kept] / stated[kept]
    return (
        f"{refits.count} simulated campaigns fitted again: standard deviations of the identified "
        f"parameters are {ratio.min():.2f} to {ratio.max():.2f} of those stated"
        + (f"; {refits.n_unsettled} did not settle" if refits.n_unsettled else "")
    )

"""`plan.csv` and `plan.json`."""

from pathlib import Path

import numpy as np

from robocal.formats.measurements_csv import approach_columns, joint_columns
from robocal.formats.table import table_text
from robocal.planning.observability import INDICES
from robocal.planning.plan import Plan
from robocal.planning.prediction import COVERAGE
from robocal.planning.relaxed import relaxed_design


def plan_csv(plan: Plan) -> str:
    """One row a visit, in order; columns as in measurements.csv."""
    visits, robot = plan.visits, plan.request.robot
    columns: dict[str, list[str]] = {
        "pose": [str(number) for number in visits.pose],
        "repeat": [str(number) for number in visits.repeat],
    }
    file_units = visits.q / robot.joint_scale
    for joint, name in enumerate(joint_columns(robot)):
        columns[name] = [f"{value:.6f}" for value in file_units[:, joint]]
    if visits.approach is not None:
        for joint, name in enumerate(approach_columns(robot)):
            columns[name] = [str(sign) for sign in visits.approach[:, joint]]
    if visits.payload is not None:
        columns["payload_kg"] = [f"{mass:g}" for mass in visits.payload]
    return table_text(columns)


def plan_document(plan: Plan) -> dict[str, object]:
    """`plan.json`: request, what the set is worth, and the index curve."""
    request, visits = plan.request, plan.visits
    document: dict[str, object] = {
        "robot": request.robot.name,
        "index": request.merit,
        "selector": request.selector,
        "seed": request.seed,
        "candidates": len(plan.candidates),
        "count": len(plan.chosen),
        "count_chosen_by": _chosen_by(plan),
        "visits": len(visits.q),
        "pure_error_degrees_of_freedom": len(visits.q) - len(plan.chosen),
        "travel_s": visits.travel_time,
        "measured": "pose" if request.cell.sees_orientation else "position",
        "parameters": list(plan.rows.names),
        "indices": plan.indices,
        "predicted_tool_uncertainty": {
            "coverage": COVERAGE,
            "test_poses": len(plan.radius),
            "U95_mean_mm": float(plan.radius.mean()) * 1e3,
            "U95_max_mm": float(plan.radius.max()) * 1e3,
        },
        "curve": _curve(plan),
    }
    if request.merit == next(iter(INDICES)):
        bound = relaxed_design(plan.rows.J).largest_index_1
        document["index_bound"] = bound
        document["index_share_of_bound"] = plan.indices[request.merit] / bound
    return document


def plan_lines(plan: Plan, out: Path) -> list[str]:
    """What the plan says to a person at a terminal."""
    request, visits = plan.request, plan.visits
    lines = [
        f"{request.robot.name}: {len(plan.chosen)} of {len(plan.candidates)} poses by "
        f"{request.selector} for {request.merit}, number from the {_chosen_by(plan)}",
        ", ".join(f"{name} {value:.4g}" for name, value in plan.indices.items()),
        f"predicted U95 of the tool: mean {plan.radius.mean() * 1e3:.4f} mm, "
        f"max {plan.radius.max() * 1e3:.4f} mm",
        f"{len(visits.q)} visits, {visits.travel_time:.0f} s of travel -> {out / 'plan.csv'}",
    ]
    for name in INDICES:
        count = plan.curve.settled_count(name)
        lines.append(
            f"{name} of random sets settles at {count} poses"
            if count
            else f"{name} of random sets does not settle up to {plan.curve.counts[-1]} poses"
        )
    return lines


def _chosen_by(plan: Plan) -> str:
    if plan.request.uncertainty is not None:
        return "uncertainty"
    return "index curve" if plan.request.count is None else "request"


def _curve(plan: Plan) -> dict[str, object]:
    """Mean and spread of every index against the number of random poses."""
    curve = plan.curve
    return {
        "count": curve.counts.tolist(),
        "indices": {
            name: {
                "mean": np.round(curve.mean[name], 9).tolist(),
                "std": np.round(curve.std[name], 9).tolist(),
                "settled_at": curve.settled_count(name),
            }
            for name in INDICES
        },
    }

"""`basecal.json`: what a base-to-base calibration found, in file units."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.base_calibration.corrections import CORRECTIONS
from robocal.base_calibration.monte_carlo import COVERAGE, RegistrationDraws
from robocal.base_calibration.next_touch import Proposal
from robocal.base_calibration.projection import Projection
from robocal.base_calibration.registration import Registration
from robocal.formats.robot_yaml import frame_document

_DEG = np.pi / 180.0


def basecal_document(
    result: Registration, projection: Projection, draws: RegistrationDraws
) -> dict[str, object]:
    """The document that the contract describes, and more beside it."""
    return {
        **registration_document(result),
        "monte_carlo": {
            "draws": len(draws.moves),
            "std": _moves(draws.std),
            "half_width": _moves(draws.half_width),
            "coverage": COVERAGE,
            "unit": ["mm", "mm", "mm", "mrad", "mrad", "mrad"],
            "of": "shift and rotation vector along the master's axes, open directions held",
        },
        "projection": _projection(projection),
    }


def registration_document(result: Registration) -> dict[str, object]:
    """What the registration alone says: of touches so far, before anything is drawn."""
    return {
        "transform": _transform(result.transform),
        "std": _six(result.std),
        "std_unit": ["mm", "mm", "mm", "deg", "deg", "deg"],
        "residual_rms_mm": result.residual_rms * 1e3,
        "chi_square": result.solution.chi_square,
        "degrees_of_freedom": result.solution.nu,
        "p_value": result.p_value,
        "touches": {
            "master": int((~result.touches.by_slave).sum()),
            "slave": int(result.touches.by_slave.sum()),
            "rejected_lines": list(result.rejected),
        },
        "undetermined": [
            {"direction": entry.words, "fixed_by": entry.fixed_by} for entry in result.undetermined
        ],
        "faults": [_fault(result, index) for index in range(len(result.faults))],
        "sensor_corrections": _corrections(result),
        "next_touch": _proposal(result.next_touch),
    }


def _transform(T: Float[Array, "4 4"]) -> dict[str, object]:
    """The contract's transform; the matrix has its translation in mm like `xyz_mm`."""
    matrix = T.copy()
    matrix[:3, 3] *= 1e3
    return {**frame_document(T), "matrix": [[float(value) for value in row] for row in matrix]}


def _six(std: Float[Array, "6"]) -> list[float | None]:
    """In mm and deg; null where the touches leave the value open."""
    unit = np.array([1e-3] * 3 + [_DEG] * 3)
    return [float(value) if np.isfinite(value) else None for value in std / unit]


def _moves(values: Float[Array, "6"]) -> list[float]:
    """In mm and mrad."""
    return [float(value) * 1e3 for value in values]


def _fault(result: Registration, index: int) -> dict[str, object]:
    fault = result.faults[index]
    meaning = {correction.name: correction.meaning for correction in CORRECTIONS}
    return {
        "fault": fault.fault,
        "meaning": meaning.get(fault.fault, "the needle did not sit in the cup at this touch"),
        "probability": fault.probability,
        "lines": list(fault.lines),
        "remedied": fault.remedied,
        "confusable_with": [
            {"fault": name, "probability": probability}
            for name, probability in fault.confusable_with
        ],
    }


def _corrections(result: Registration) -> list[dict[str, object]]:
    rows = []
    for correction, found, prior_std in zip(
        CORRECTIONS, result.corrections, result.stage.prior_std, strict=True
    ):
        row: dict[str, object] = {
            "name": correction.field,
            "meaning": correction.meaning,
            "value": found.value / correction.scale,
            "std": found.std / correction.scale,
            "prior_std": float(prior_std) / correction.scale,
            "status": found.status,
            "hidden": found.hidden,
            "fault_found_from": (
                found.found_from / correction.scale if np.isfinite(found.found_from) else None
            ),
            "usual_fault": correction.fault_std / correction.scale,
            "base_shift_mm_if_missed": found.base_shift * 1e3,
        }
        if found.hidden:
            row["revealed_by"] = correction.revealed_by
        rows.append(row)
    return rows


def _projection(projection: Projection) -> dict[str, object]:
    answers: dict[str, object] = {"transform": None}
    if projection.transform is not None:
        answers = {
            "transform": _transform(projection.transform),
            "first_xyz_mm": _moves_or_none(projection.first),
            "second_xyz_mm": _moves_or_none(projection.second),
        }
    return {
        **answers,
        "refusal": projection.refusal,
        "assumptions": [
            {"name": entry.name, "holds": entry.holds, "finding": entry.finding}
            for entry in projection.assumptions
        ],
    }


def _moves_or_none(values: Float[Array, "3"] | None) -> list[float] | None:
    return None if values is None else [float(value) * 1e3 for value in values]


def _proposal(proposal: Proposal | None) -> dict[str, object] | None:
    if proposal is None:
        return None
    row: dict[str, object] = {
        "robot": "slave" if proposal.by_slave else "master",
        "cup": "rod" if proposal.on_rod else "slide",
        "slide_mm": proposal.slide * 1e3,
        "rod_angle_deg": proposal.angle / _DEG if proposal.on_rod else None,
        "rod_length_mm": proposal.length * 1e3 if proposal.on_rod else None,
        "place_mm": [float(value) * 1e3 for value in proposal.place],
        "uncertainty_before_mm": proposal.before * 1e3,
        "uncertainty_after_mm": proposal.after * 1e3,
    }
    return row

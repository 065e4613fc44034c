"""`diagnosis.json`: what the model gets wrong and why, in file units."""

from dataclasses import asdict

from robocal.diagnosis.causes import Cause
from robocal.diagnosis.diagnosis import Diagnosis, NamedEffect
from robocal.diagnosis.extended import FittedEffect
from robocal.diagnosis.gain import Gain
from robocal.diagnosis.pure_error import PureError
from robocal.diagnosis.steps import LAST_BEFORE, LINE

NEXT_POSES = "next_poses.csv"


def diagnosis_document(diagnosis: Diagnosis) -> dict[str, object]:
    """The document that the contract describes."""
    adequacy = diagnosis.adequacy
    return {
        "verdict": diagnosis.verdict.value,
        "lack_of_fit": {
            "statistic": diagnosis.geometry_adequacy.reduced_chi_square,
            "p_value": diagnosis.lack_of_fit_p,
        },
        "pure_error": _pure_error(diagnosis.pure_error),
        "effects": [_effect(named) for named in diagnosis.effects],
        "data_faults": _faults(diagnosis),
        "rejected_rows": [asdict(row) for row in diagnosis.unusable],
        "suspect_held_out_rows": [asdict(row) for row in diagnosis.suspect],
        "depends_on": [
            {"covariate": found.covariate, "p_value": found.p_value}
            for found in diagnosis.depends_on
        ],
        "gain": _gain(diagnosis.gain),
        "noise_floor_mm": diagnosis.noise_floor * 1e3,
        "over_noise_floor": diagnosis.over_noise_floor,
        "adequacy": {
            "verdict": "adequate" if adequacy.adequate else "inadequate",
            "judged": adequacy.judged,
            "reduced_chi_square": adequacy.reduced_chi_square if adequacy.nu > 0 else None,
            "band99": [adequacy.low, adequacy.high] if adequacy.nu > 0 else None,
        },
        "hidden": list(diagnosis.hidden),
        "next_poses": NEXT_POSES if len(diagnosis.next_poses.q) else None,
        "next_steps": {
            "between": list(diagnosis.next_poses.between or ()),
            "words": list(diagnosis.next_poses.words),
        },
        "bundle_sha256": diagnosis.bundle_sha256,
    }


def _pure_error(repeats: PureError | None) -> dict[str, object] | None:
    """What repeats of one pose say; None where nothing was repeated."""
    if repeats is None:
        return None
    return {
        "variance_over_declared": repeats.ratio,
        "degrees_of_freedom": repeats.nu,
        "contradicts_declared": repeats.is_larger_than_declared,
        "geometry_lack_of_fit_p": repeats.geometry_p,
        "lack_of_fit_p": repeats.model_p,
    }


def _effect(named: NamedEffect) -> dict[str, object]:
    instance = named.fitted.instance
    document: dict[str, object] = {"effect": instance.effect}
    if instance.joint is not None:
        document["joint"] = instance.joint
    document |= _arguments(dict(instance.arguments))
    document |= {
        "probability": named.probability,
        "parameters": _parameters(named.fitted),
        "explained_fraction": named.explained_fraction,
        "confusable_with": [
            _cause(cause)
            for cause in named.naming.causes
            if cause.key != (instance.effect, instance.joint)
        ],
        "nothing_probability": named.naming.none,
        "outside_the_catalogue": _outside(named),
        "gain": _gain(named.gain),
        "blocked_gain": _reduction(named.blocked_gain),
        "in_sample_only": named.in_sample_only,
        "form_corrections": [_correction(fitted) for fitted in named.form_corrections],
    }
    return document


def _outside(named: NamedEffect) -> dict[str, object]:
    """How probable it is that something without a name stands there, and what that goes with."""
    moved_by = named.naming.moved_by
    return {
        "probability": named.naming.unlisted,
        "goes_with": moved_by.covariate if moved_by is not None else None,
    }


def _parameters(fitted: FittedEffect) -> dict[str, object]:
    return {
        coefficient.name: {"value": float(value), "std": float(std)}
        for coefficient, value, std in zip(
            fitted.instance.coefficients, fitted.values, fitted.std, strict=True
        )
    }


def _correction(fitted: FittedEffect) -> dict[str, object]:
    """A small effect that mends the form of a larger one."""
    instance = fitted.instance
    joint = {} if instance.joint is None else {"joint": instance.joint}
    arguments = _arguments(dict(instance.arguments))
    return {"effect": instance.effect, **joint, **arguments, "parameters": _parameters(fitted)}


def _arguments(arguments: dict[str, float]) -> dict[str, object]:
    """Lines and joints as whole numbers."""
    whole = (LINE, LAST_BEFORE, "driven_by")
    return {
        name: int(value) if name in whole else float(value) for name, value in arguments.items()
    }


def _cause(cause: Cause) -> dict[str, object]:
    document: dict[str, object] = {"effect": cause.instance.effect}
    if cause.instance.joint is not None:
        document["joint"] = cause.instance.joint
    return (
        document | _arguments(dict(cause.instance.arguments)) | {"probability": cause.probability}
    )


def _gain(gain: Gain) -> dict[str, object]:
    return {
        "held_out_rms_before_mm": gain.before * 1e3,
        "held_out_rms_after_mm": gain.after * 1e3,
        **_reduction(gain),
    }


def _reduction(gain: Gain) -> dict[str, object]:
    """Of residuals over the noise, which have no unit."""
    return {"reduction": gain.reduction, "ci95": list(gain.ci95)}


def _faults(diagnosis: Diagnosis) -> list[dict[str, object]]:
    """Faults of the data, not of the robot."""
    faults: list[dict[str, object]] = [
        {
            "fault": slip.fault.value,
            "lines": list(slip.lines),
            "columns": list(slip.columns),
            "mend": slip.report(),
        }
        for slip in diagnosis.slips
    ]
    if diagnosis.outliers:
        faults.append({"fault": "outlier", "lines": [row.line for row in diagnosis.outliers]})
    return faults

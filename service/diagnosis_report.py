"""`report.html`: the diagnosis for the plant engineer, in one file."""

from dataclasses import asdict, dataclass
from importlib.metadata import version
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from robocal.data_faults.slip import mend_whichever
from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.diagnosis import Diagnosis, NamedEffect
from robocal.diagnosis.effect import Instance
from robocal.formats.bundle import Bundle
from robocal.robots.robot import Robot
from service.diagnosis_advice import advice_on
from service.diagnosis_covariates import Covariates, covariates_of
from service.diagnosis_plots import covariate_plots, residual_plot
from service.report_lines import (
    change_text,
    headline,
    mended_lines,
    noise_lines,
    not_used_lines,
    suspect_lines,
)

_MOST_CAUSES = 8
_UNITS = (
    ("_rad_kg_per_nm", "µrad·kg per N·m", 1e6),
    ("_rad_per_nm", "µrad per N·m", 1e6),
    ("_rad_per_k", "µrad per K", 1e6),
    ("_m_per_k", "µm per K", 1e6),
    ("_per_k", "ppm per K", 1e6),
    ("_m_per_rad", "mm per rad", 1e3),
    ("_rad_per_m", "mrad per mm", 1.0),
    ("_rad", "mrad", 1e3),
    ("_m", "mm", 1e3),
)
"""Endings of coefficients, the unit in which a person reads them, and the factor."""

_MOST_ROWS = 30


@dataclass(frozen=True)
class CauseText:
    """One cause as the page tells it."""

    what: str
    """In words."""
    name: str
    """As the public interface calls it."""
    cost: float
    """RMS that it adds [mm]"""
    values: tuple[str, ...]
    probability: float
    share: float
    others: tuple[str, ...]
    corrections: tuple[str, ...]
    """Small effects that mend its form."""
    goes_with: str | None
    """Covariate of a cause outside the catalogue, where that is more probable."""
    in_sample_only: bool
    advice: str


def report_html(bundle: Bundle, found: Diagnosis) -> str:
    """The page as text."""
    environment = Environment(
        loader=PackageLoader("service", "reports"), autoescape=True, undefined=StrictUndefined
    )
    return environment.get_template("diagnosis.html").render(report_parts(bundle, found))


def report_parts(bundle: Bundle, found: Diagnosis) -> dict[str, Any]:
    """All that a reader is shown, for the report and for the service's page; pictures as SVG."""
    return {
        "robot": bundle.robot.name,
        "rows": len(bundle.measurements),
        "date": found.calibrated.provenance.date,
        "version": version("robocal"),
        "verdict": _capital(headline(found)),
        "before": found.gain.before * 1e3,
        "after": found.gain.after * 1e3,
        "reduction": found.gain.reduction,
        "low": found.gain.ci95[0],
        "high": found.gain.ci95[1],
        "change": change_text(found.gain),
        "floor": found.noise_floor * 1e3,
        "causes": [
            asdict(cause_text(named, bundle.robot)) for named in found.effects[:_MOST_CAUSES]
        ],
        "more": max(len(found.effects) - _MOST_CAUSES, 0),
        "plot": residual_plot(found.residuals),
        "repeats": found.pure_error.lack_of_fit if found.pure_error is not None else "",
        "plots": covariate_plots(_covariates(bundle, found), found.residuals),
        "faults": [*mended_lines(found.slips), *noise_lines(found), *_not_used(found)],
        "remains": [dependence.covariate for dependence in found.depends_on[:6]],
        "between": found.next_poses.between,
        "words": found.next_poses.words,
        "hidden": found.hidden,
    }


def _covariates(bundle: Bundle, found: Diagnosis) -> Covariates:
    """Of the rows as they were diagnosed: mended, and in the order of measuring."""
    rows = mend_whichever(bundle, found.slips).measurements
    place = {line: row for row, line in enumerate(rows.lines.tolist())}
    order = np.array([place[line] for line in found.residuals.lines.tolist()], dtype=int)
    return covariates_of(found.calibrated.circumstances_of(rows.rows(order)))


def _not_used(found: Diagnosis) -> list[str]:
    lines = suspect_lines(found.suspect) + not_used_lines((*found.outliers, *found.unusable))
    more = len(lines) - _MOST_ROWS
    return lines if more <= 0 else [*lines[:_MOST_ROWS], f"and {more} lines more: diagnosis.json"]


def cause_text(named: NamedEffect, robot: Robot) -> CauseText:
    """One cause in words and figures."""
    instance = named.fitted.instance
    gain = named.gain
    values = tuple(
        measure_text(coefficient.name, value, std)
        for coefficient, value, std in zip(
            instance.coefficients, named.fitted.values, named.fitted.std, strict=True
        )
    )
    others = [
        f"{cause.instance.title} ({100 * cause.probability:.0f} %)"
        for cause in named.naming.causes
        if cause.key != (instance.effect, instance.joint)
    ]
    if named.naming.may_be_nothing:
        others.append(f"nothing but noise ({100 * named.naming.none:.0f} %)")
    return CauseText(
        what=_heading(instance) if named.goes_with is None else _stranger(named.goes_with),
        name=instance.title,
        cost=float(np.sqrt(max(gain.before**2 - gain.after**2, 0.0))) * 1e3,
        values=values,
        probability=named.probability,
        share=named.explained_fraction,
        others=tuple(others),
        corrections=tuple(fitted.instance.title for fitted in named.form_corrections),
        goes_with=named.goes_with,
        in_sample_only=named.in_sample_only,
        advice=advice_on(named, robot),
    )


def _stranger(covariate: str) -> str:
    """A cause without a name, by what it goes with."""
    return f"Something unknown that goes with {covariate}"


def _heading(instance: Instance) -> str:
    """In words: where, and what it is."""
    meaning = (type(EFFECTS[instance.effect]).__doc__ or "").strip().rstrip(".")
    where = "" if instance.joint is None else f"Joint {instance.joint}: "
    arguments = ", ".join(instance.details)
    return f"{where}{meaning[:1].lower() if where else meaning[:1]}{meaning[1:]}" + (
        f" ({arguments})" if arguments else ""
    )


def measure_text(name: str, value: float, std: float) -> str:
    """A coefficient in a unit that a person reads.

    >>> measure_text("compliance_rad_per_nm", 1.2e-6, 1e-7)
    'compliance in µrad per N·m: 1.2 ± 0.1'
    """
    quantity, factor = name, 1.0
    for ending, unit, scale in _UNITS:
        if name.endswith(ending):
            quantity, factor = f"{name.removesuffix(ending)} in {unit}", scale
            break
    return f"{quantity.replace('_', ' ')}: {value * factor:.3g} ± {std * factor:.2g}"


def _capital(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]

"""Effects as `model.yaml` holds them: what acts, where, how much, and how surely."""

import numpy as np

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.effect import Coefficient, Instance
from robocal.diagnosis.extended import FittedEffect
from robocal.diagnosis.reference import PAYLOAD, Reference
from robocal.diagnosis.steps import gap_of, is_step
from robocal.formats.fields import Fields
from robocal.measurements import approach_column


def effect_document(fitted: FittedEffect) -> dict[str, object]:
    """One effect; coefficients in the units of their names."""
    instance = fitted.instance
    document: dict[str, object] = {"effect": instance.effect}
    if instance.joint is not None:
        document["joint"] = instance.joint
    document["arguments"] = dict(instance.arguments)
    document["coefficients"] = {
        coefficient.name: {"value": float(value), "std": float(std)}
        for coefficient, value, std in zip(
            instance.coefficients, fitted.values, fitted.std, strict=True
        )
    }
    return document


def read_effect(fields: Fields) -> FittedEffect:
    """One effect from an open mapping."""
    name = fields.text("effect")
    if name not in EFFECTS:
        raise fields.error("effect", f"'{name}' is not in the catalogue")
    joint = int(fields.number("joint")) if "joint" in fields else None
    given = fields.mapping("arguments")
    arguments = tuple((key, given.number(key)) for key in given.names())
    listed = fields.mapping("coefficients")
    names, values, std = [], [], []
    for key in listed.names():
        coefficient = listed.mapping(key)
        names.append(Coefficient(key, 1.0))
        values.append(coefficient.number("value"))
        std.append(coefficient.number("std"))
        coefficient.finish()
    fields.finish()
    instance = Instance(name, joint, arguments, tuple(names))
    return FittedEffect(instance, np.array(values), np.diag(np.square(std)))


def reference_document(
    reference: Reference, effects: tuple[FittedEffect, ...]
) -> dict[str, object]:
    """What times, temperatures and speeds are counted from, and when each step came."""
    gaps = [gap_of(fitted.instance) for fitted in effects if is_step(fitted.instance)]
    known = dict(reference.moments)
    # Rows on both sides at one time: no time says which of them a step came before.
    if any(known.get(before) == known.get(first) for before, first in gaps):
        known = {}
    moments = [
        (line, time)
        for line, time in known.items()
        if any(before <= line <= first for before, first in gaps)
    ]
    return {
        "time_start_s": reference.time_start,
        "time_span_s": reference.time_span,
        "time_is_seconds": reference.timed,
        "temperature_degc": reference.temperature,
        "speed": reference.speed,
        "complete_columns": sorted(reference.complete),
        "step_lines": [line for line, _ in moments],
        "step_t_s": [time for _, time in moments],
    }


def read_reference(fields: Fields, effects: tuple[FittedEffect, ...]) -> Reference:
    """The same from an open mapping."""
    start, span = fields.number("time_start_s"), fields.number("time_span_s")
    complete = _complete_of_old(effects)
    if "complete_columns" in fields:
        complete = frozenset(fields.texts("complete_columns"))
    lines: tuple[float, ...] = ()
    if "step_lines" in fields:
        lines = fields.numbers("step_lines", None)
    times = fields.numbers("step_t_s", len(lines)) if lines or "step_t_s" in fields else ()
    if (np.diff(times) < 0.0).any():
        raise fields.error("step_t_s", "must not go back in time")
    reference = Reference(
        start,
        span,
        fields.number("temperature_degc"),
        fields.number("speed"),
        # Files from before it was kept: shares of all rows begin at zero and end below one.
        timed=fields.flag("time_is_seconds", default=start != 0.0 or span >= 1.0),
        moments=tuple(zip(lines, times, strict=True)),
        complete=complete,
    )
    fields.finish()
    return reference


def _complete_of_old(effects: tuple[FittedEffect, ...]) -> frozenset[str]:
    """What files from before it was kept must have had: an effect of the payload alone needs it."""
    instances = [fitted.instance for fitted in effects]
    sides = [approach_column(i.joint) for i in instances if i.effect == "backlash" and i.joint]
    loads = [PAYLOAD for i in instances if i.effect == "payload_compliance"]
    return frozenset((*sides, *loads))

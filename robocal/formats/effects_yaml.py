"""Effects as `model.yaml` holds them: what acts, where, how much, and how surely."""

import numpy as np

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.circumstances import Reference
from robocal.diagnosis.effect import Coefficient, Instance
from robocal.diagnosis.extended import FittedEffect
from robocal.formats.fields import Fields


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


def reference_document(reference: Reference) -> dict[str, float]:
    """What times, temperatures and speeds are counted from."""
    return {
        "time_start_s": reference.time_start,
        "time_span_s": reference.time_span,
        "temperature_degc": reference.temperature,
        "speed": reference.speed,
    }


def read_reference(fields: Fields) -> Reference:
    """The same from an open mapping."""
    reference = Reference(
        fields.number("time_start_s"),
        fields.number("time_span_s"),
        fields.number("temperature_degc"),
        fields.number("speed"),
    )
    fields.finish()
    return reference

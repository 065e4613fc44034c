"""The fields of the forms, made from the models that the REST interface accepts."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from pydantic import BaseModel

from drivers.registry import ROBOTS as ROBOT_DRIVERS
from drivers.registry import TRACKERS as TRACKER_DRIVERS
from robocal.robots.library import ROBOTS
from service.campaigns.models import CampaignKind, NewCampaign
from service.cells.models import NewCell

KINDS_OFFERED = (CampaignKind.calibrate, CampaignKind.verify, CampaignKind.health)
SUGGESTED_POSES = 40
"""Enough for the 30 parameters of a six-axis arm with a quarter of the poses held out."""

_UNITS = {
    "_mm": "mm",
    "_ppm": "ppm",
    "_mrad": "mrad",
    "_deg_s": "°/s",
    "_deg_s2": "°/s²",
    "_s": "s",
    "_kg": "kg",
}

Schema = dict[str, Any]


@dataclass(frozen=True)
class Field:
    """One input."""

    path: str
    """Where its value stands in the request, `robot.model`."""
    numeric: bool
    value: str
    """What it starts with."""
    choices: tuple[str, ...]
    """What may be chosen; empty for free text and numbers."""
    nullable: bool
    """Whether it may be left empty, which the request says as null."""
    attributes: tuple[tuple[str, str], ...]
    """HTML attributes with which the browser checks the value."""

    @property
    def key(self) -> str:
        """Name of its words, and of the element."""
        return self.path.replace(".", "_")

    @property
    def unit(self) -> str:
        """The unit that its name ends with; empty without one."""
        endings = [ending for ending in _UNITS if self.path.endswith(ending)]
        return _UNITS[max(endings, key=len)] if endings else ""


def cell_fields() -> tuple[Field, ...]:
    """What a new cell must say."""
    return _fields(
        NewCell,
        {
            "name": (),
            "robot.model": ROBOTS,
            "robot.driver": tuple(sorted(ROBOT_DRIVERS)),
            "robot.address": (),
            "tracker.driver": tuple(sorted(TRACKER_DRIVERS)),
            "tracker.address": (),
        },
    )


def cell_detail_fields() -> tuple[Field, ...]:
    """What a new cell may say: the instrument's uncertainty and the speed."""
    tracker = ("tracker.sigma_mm", "tracker.sigma_ppm", "tracker.sigma_mrad")
    limits = (
        "limits.speed_deg_s",
        "limits.acceleration_deg_s2",
        "limits.full_speed_deg_s",
        "limits.floor_mm",
    )
    return _fields(NewCell, dict.fromkeys((*tracker, *limits), ()))


def campaign_fields(cells: Sequence[str]) -> tuple[Field, ...]:
    """What a new campaign must say."""
    return _fields(
        NewCampaign,
        {
            "cell": tuple(cells),
            "kind": KINDS_OFFERED,
            "poses": (),
            "repeats": (),
            "settle_s": (),
            "payload_kg": (),
        },
        {"poses": str(SUGGESTED_POSES)},
    )


def payload_field(held: float) -> Field:
    """What the arm holds in a follow-up, beginning with what it held."""
    (field,) = _fields(NewCampaign, {"payload_kg": ()})
    return replace(field, value=f"{held:g}")


def _fields(
    model: type[BaseModel],
    choices: dict[str, tuple[str, ...]],
    suggestions: dict[str, str] | None = None,
) -> tuple[Field, ...]:
    schema = model.model_json_schema()
    suggested = suggestions or {}
    return tuple(
        _field(schema, path, options, suggested.get(path)) for path, options in choices.items()
    )


def _field(schema: Schema, path: str, choices: tuple[str, ...], suggested: str | None) -> Field:
    own = _property(schema, path)
    numeric = own.get("type") in {"number", "integer"}
    default = own.get("default")
    default = "" if default is None else default
    return Field(
        path=path,
        numeric=numeric,
        value=suggested or (f"{default:g}" if numeric and default != "" else str(default)),
        choices=tuple(str(choice) for choice in choices),
        nullable=suggested is None and {"type": "null"} in own.get("anyOf", []),
        attributes=tuple(_attributes(own)),
    )


def _property(schema: Schema, path: str) -> Schema:
    """Return the schema of one value; of several kinds of value the first."""
    node = schema
    for name in path.split("."):
        node = _resolved(schema, node)["properties"][name]
    node = _resolved(schema, node)
    return {**node["anyOf"][0], **node} if "anyOf" in node else node


def _resolved(schema: Schema, node: Schema) -> Schema:
    if "$ref" not in node:
        return node
    target: Schema = schema["$defs"][node["$ref"].removeprefix("#/$defs/")]
    return target


def _attributes(own: Schema) -> list[tuple[str, str]]:
    found = [
        (attribute, f"{own[name]:g}")
        for name, attribute in (
            ("minimum", "min"),
            ("exclusiveMinimum", "min"),
            ("maximum", "max"),
            ("maxLength", "maxlength"),
        )
        if name in own
    ]
    if own.get("type") in {"number", "integer"}:
        found.append(("step", "1" if own["type"] == "integer" else "any"))
    if "pattern" in own:
        # A browser reads patterns in Unicode sets mode, where a hyphen in a class is escaped.
        found.append(("pattern", re.sub(r"(?<!\\)-\]", r"\\-]", own["pattern"])))
    return found

"""What a diagnosis said, read from diagnosis.json as the public interface describes it."""

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.blind.truth import HiddenEffect

STATED = 0.95
"""Probability of the stated set of causes; [1]"""
SAME_ORDER = 0.5
"""Orders that differ by less are the same harmonic; [1]"""


@dataclass(frozen=True)
class Cause:
    """An effect at a place, and how probable it is said to be."""

    effect: str
    joint: int | None
    order: float | None
    driven_by: int | None
    probability: float

    def is_(self, hidden: HiddenEffect) -> bool:
        """Whether this names the hidden effect."""
        if (self.effect, self.joint) != (hidden.effect, hidden.joint):
            return False
        if hidden.order is not None and self.order is not None:
            return abs(self.order - hidden.order) < SAME_ORDER
        return self.driven_by in {None, hidden.driven_by}

    @property
    def title(self) -> str:
        """For people."""
        return self.effect + ("" if self.joint is None else f" J{self.joint}")


@dataclass(frozen=True)
class Named:
    """One effect of the extended model, with its rivals."""

    cause: Cause
    rivals: tuple[Cause, ...]

    @property
    def stated(self) -> tuple[Cause, ...]:
        """The most probable causes that together hold 95 %."""
        kept: list[Cause] = []
        for cause in sorted((self.cause, *self.rivals), key=lambda cause: -cause.probability):
            kept.append(cause)
            if sum(each.probability for each in kept) >= STATED:
                break
        return tuple(kept)


@dataclass(frozen=True)
class Verdict:
    """The diagnosis of one bundle."""

    word: str
    """The contract's word; `refused` for no answer, `broken down` for a programming error."""
    named: tuple[Named, ...] = ()
    covariates: tuple[str, ...] = ()
    """Kinds, the most significant first."""
    faults: tuple[tuple[str, tuple[int, ...]], ...] = ()
    after_mm: float = 0.0
    """Held-out error of the extended model."""

    @property
    def alarmed(self) -> bool:
        """Whether it says that something is wrong with the model."""
        return self.word != "model_adequate"

    @property
    def calls_adequate(self) -> bool:
        """Whether it says that nothing more is left."""
        return self.word in {"model_adequate", "explained"}

    def names(self, hidden: HiddenEffect) -> bool:
        """Whether the hidden effect is among the named."""
        return any(named.cause.is_(hidden) for named in self.named)

    def states(self, hidden: HiddenEffect) -> bool:
        """Whether it is in the stated set of one of the named."""
        return any(cause.is_(hidden) for named in self.named for cause in named.stated)

    def is_exactly(self, hidden: tuple[HiddenEffect, ...]) -> bool:
        """Whether these and no others are named."""
        return len(self.named) == len(hidden) and all(self.names(effect) for effect in hidden)


BROKEN_DOWN = "breakdown.txt"
"""File beside diagnosis.json that holds the traceback of a diagnosis that broke down."""
REFUSED, BROKEN = Verdict("refused"), Verdict("broken down")


def read_verdict(result: Path) -> Verdict:
    """Read the folder of a diagnosis; one without diagnosis.json was refused, or broke down."""
    path = result / "diagnosis.json"
    if not path.exists():
        return BROKEN if (result / BROKEN_DOWN).exists() else REFUSED
    return verdict_of(json.loads(path.read_text()))


def verdict_of(document: dict[str, Any]) -> Verdict:
    """Read diagnosis.json."""
    depends = sorted(document["depends_on"], key=lambda entry: entry["p_value"])
    return Verdict(
        word=document["verdict"],
        named=tuple(_named(entry) for entry in document["effects"]),
        covariates=tuple(covariate_kind(entry["covariate"]) for entry in depends),
        faults=tuple((f["fault"], tuple(f.get("lines", ()))) for f in document["data_faults"]),
        after_mm=document["gain"]["held_out_rms_after_mm"],
    )


def _named(entry: dict[str, Any]) -> Named:
    return Named(_cause(entry), tuple(_cause(rival) for rival in entry["confusable_with"]))


def _cause(entry: dict[str, Any]) -> Cause:
    return Cause(
        effect=entry["effect"],
        joint=entry.get("joint"),
        order=entry.get("order"),
        driven_by=entry.get("driven_by"),
        probability=entry["probability"],
    )


_KINDS = {
    "t_s": "time",
    "row": "time",
    "temperature_degc": "temperature",
    "payload_kg": "payload",
    "reach_mm": "reach",
    "settle_s": "settle",
}


def covariate_kind(name: str) -> str:
    """The kind of a covariate: j3_deg is joint3, t_s is time, approach2 stays."""
    joint = re.fullmatch(r"j(\d+)_(deg|mm)", name)
    if joint:
        return f"joint{joint[1]}"
    numbered = re.match(r"(approach|move|torque)_?(\d+)", name)
    if numbered:
        return numbered[1] + numbered[2]
    if "orientation" in name:
        return "orientation"
    return _KINDS.get(name, name)

"""The sealed truth of a blind trial, opened after the verdict."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class HiddenEffect:
    """One effect that was hidden."""

    effect: str
    joint: int | None
    order: float | None
    """Cycles a turn of a gear harmonic."""
    driven_by: int | None
    listed: bool
    """Whether the catalogue holds it."""
    main: bool
    """False for the faint ones in the background."""
    snr: float
    """Root mean square per coordinate of what survives projection, over the noise; [1]"""
    strength: float
    """Lambda, the length of that; [1]"""

    @property
    def title(self) -> str:
        """For people."""
        return self.effect + ("" if self.joint is None else f" J{self.joint}")


@dataclass(frozen=True)
class Truth:
    """Everything that scoring needs."""

    kind: str
    effects: tuple[HiddenEffect, ...]
    covariates: tuple[str, ...]
    """What the error of an unlisted cause depends on."""
    kindred: tuple[tuple[str, int | None], ...]
    """Listed effects that would not be a wrong name for an unlisted cause."""
    fault: str | None
    lines: tuple[int, ...]
    noise_floor_mm: float

    @property
    def main(self) -> tuple[HiddenEffect, ...]:
        """What the trial is about."""
        return tuple(effect for effect in self.effects if effect.main)


def read_truth(path: Path) -> Truth:
    """Open it."""
    document = json.loads(path.read_text())
    fault = document["fault"] or {"fault": None, "lines": []}
    return Truth(
        kind=document["options"]["kind"],
        effects=tuple(_effect(entry) for entry in document["effects"]),
        covariates=tuple(document["covariates"]),
        kindred=tuple((name, joint) for name, joint in document["kindred"]),
        fault=fault["fault"],
        lines=tuple(fault["lines"]),
        noise_floor_mm=document["noise_floor_mm"],
    )


def _effect(entry: dict[str, Any]) -> HiddenEffect:
    return HiddenEffect(
        effect=entry["effect"],
        joint=entry["joint"],
        order=entry["order"],
        driven_by=entry["entries"].get("driven_by"),
        listed=entry["listed"],
        main=entry["main"],
        snr=entry["snr"],
        strength=entry["strength"],
    )

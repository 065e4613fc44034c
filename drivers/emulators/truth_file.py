"""The sealed truth of a case, as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from drivers.emulators.blind_case import RANGE_NOISE, Case, Options
from drivers.emulators.campaign_draw import Size
from drivers.emulators.effects import LISTED
from drivers.emulators.slips import Spoilt
from drivers.emulators.visibility import Visibility, difference, geometry_basis, visibility

AXES = 3


def effect_sizes(case: Case) -> list[Visibility]:
    """How much of each hidden effect the fit rows show."""
    if not case.hidden:
        return []
    campaign, sigma = case.campaign, case.options.sigma
    fit, now = ~campaign.check, campaign.circumstances()
    basis = geometry_basis(case.cell, campaign.q[fit], sigma)
    return [
        visibility(difference(case.cell, case.without(k), campaign.q, now, sigma), basis, fit)
        for k in range(len(case.hidden))
    ]


def write_truth(path: Path, case: Case, spoilt: Spoilt | None) -> None:
    """Write everything that was drawn."""
    sizes = effect_sizes(case)
    effects = [
        {
            "effect": hidden.effect,
            "listed": hidden.effect in LISTED,
            "main": hidden.main,
            "joint": hidden.entries.get("joint"),
            "order": hidden.entries.get("order"),
            "entries": _finite(hidden.entries),
            "snr": size.snr,
            "strength": size.strength,
            "raw": size.raw,
        }
        for hidden, size in zip(case.hidden, sizes, strict=True)
    ]
    if case.noise_ppm > 0.0:
        nothing = {"joint": None, "order": None, "snr": 0.0, "strength": 0.0, "raw": 0.0}
        entries = {"noise_ppm": case.noise_ppm}
        named = {"effect": RANGE_NOISE, "listed": False, "main": True, "entries": entries}
        effects.append({**named, **nothing})
    document = {
        "options": asdict(case.options),
        "effects": effects,
        "covariates": case.covariates,
        "kindred": case.kindred,
        "fault": None if spoilt is None else {"fault": spoilt.fault, "lines": spoilt.lines},
        "fit_rows": int(np.sum(~case.campaign.check)),
        "noise_floor_mm": case.options.sigma_mm * math.sqrt(AXES),
        "links": {
            name: getattr(case.cell.table, name).tolist()
            for name in ("theta", "d", "a", "alpha", "beta")
        },
        "base": case.cell.base.tolist(),
        "tool": case.cell.tool.tolist(),
    }
    path.write_text(json.dumps(document, indent=1))


def _finite(entries: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: value
        for name, value in entries.items()
        if not (isinstance(value, float) and math.isinf(value))
    }


def read_options(path: Path) -> Options:
    """Read what a case was drawn from."""
    entries = json.loads(path.read_text())["options"]
    return Options(**{**entries, "size": Size(**entries["size"])})

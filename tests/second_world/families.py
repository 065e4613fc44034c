"""The families of effects that may be hidden, and which of them a case hides."""

from collections.abc import Callable

import numpy as np

from tests.second_world import frame_effects, joint_effects
from tests.second_world.campaign import Campaign
from tests.second_world.draw import Draw, Hidden

FAINT = 0.25
"""Size of the effects in the background, of their usual one."""
KINDS = ("clean", "one", "other_forms", "two", "background")

FAMILIES: dict[str, Callable[[Draw], Hidden]] = {
    family.__name__: family
    for family in (
        joint_effects.joint_compliance,
        joint_effects.payload_compliance,
        frame_effects.link_bending,
        frame_effects.base_compliance,
        joint_effects.gear_once,
        joint_effects.gear_twice,
        joint_effects.strain_wave,
        joint_effects.encoder_gain,
        joint_effects.joint_coupling,
        joint_effects.backlash,
        joint_effects.load_backlash,
        frame_effects.thermal_expansion,
        frame_effects.tool_step,
        frame_effects.base_step,
        frame_effects.base_drift,
        joint_effects.settling,
    )
}


def drawn(
    kind: str, rng: np.random.Generator, campaign: Campaign, chosen: str | None
) -> list[Hidden]:
    """The effects of one case, the main one first."""
    names = [str(name) for name in rng.permutation(list(FAMILIES))]
    if chosen:
        names = [chosen, *(name for name in names if name != chosen)]
    count = {"clean": 0, "two": 2, "background": len(names)}.get(kind, 1)
    faint = [FAINT if kind == "background" and place > 0 else 1.0 for place in range(count)]
    other = kind == "other_forms"
    return [
        FAMILIES[name](Draw(rng, campaign, scale, other))
        for name, scale in zip(names[:count], faint, strict=True)
    ]

"""How large the causes outside the catalogue are, what they depend on, and what is akin to them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from drivers.emulators.size_draw import Entries, Scene


@dataclass(frozen=True)
class Unlisted:
    """A cause that the catalogue does not hold.

    `covariates` are what a diagnosis may rightly say that the error depends on: kinds, with the
    joint where one is meant. `kindred` are effects of the catalogue that would not be a wrong name.
    """

    effect: str
    entries: Entries
    covariates: tuple[str, ...]
    kindred: tuple[tuple[str, int | None], ...] = ()


def hysteresis(scene: Scene) -> Unlisted:
    """0.1 to 0.6 mrad, over loops of 0.3 to 1.2 rad."""
    joint = scene.turning_joint()
    entries = {
        "joint": joint,
        "height_mrad": scene.between(0.1, 0.6),
        "loop_rad": float(scene.draw.uniform(0.3, 1.2)),
    }
    covariates = (f"approach{joint}", f"move{joint}", f"joint{joint}")
    kindred = (("backlash", joint), ("settling", joint))
    return Unlisted("hysteresis", entries, covariates, kindred)


def axis_wobble(scene: Scene) -> Unlisted:
    """50 to 400 microradian and as many tenths of a micrometre."""
    joint = int(scene.draw.integers(1, scene.table.n_joints))
    entries = {
        "joint": joint,
        "tilt_urad": scene.between(50.0, 400.0),
        "shift_um": scene.between(5.0, 40.0),
        "phase_deg": scene.phase(),
    }
    return Unlisted("axis_wobble", entries, (f"joint{joint}",))


def stiffening_compliance(scene: Scene) -> Unlisted:
    """Five times as soft below a fifth of the largest load."""
    joint = scene.loaded_joint(scene.loads)
    largest = float(scene.loads[joint - 1])
    entries = {
        "joint": joint,
        "soft_rad_per_nm": scene.between(0.4e-3, 4e-3) / largest,
        "knee_nm": 0.2 * largest,
    }
    kindred = (("joint_compliance", joint), ("load_backlash", joint))
    covariates = (f"torque{joint}", f"joint{joint}", "joint2", "joint3", "payload", "reach")
    return Unlisted("stiffening_compliance", entries, covariates, kindred)


def bearing_compliance(scene: Scene) -> Unlisted:
    """2 to 20 microradian a newton metre at the largest arm torque of 106 N m."""
    joint = int(scene.draw.choice([2, 3]))
    c = scene.between(2e-6, 20e-6) * 106.0 / float(scene.loads.max())
    entries = {"joint": joint, "compliance_rad_per_nm": c}
    kindred = (
        ("link_bending", joint - 1),
        ("link_bending", joint),
        ("base_compliance", None),
    )
    covariates = (*(f"joint{j}" for j in range(1, joint + 3)), "payload", "reach")
    return Unlisted("bearing_compliance", entries, covariates, kindred)


def subdivision_error(scene: Scene) -> Unlisted:
    """10 to 100 microradian, once a line of a disc of 1000 to 4000."""
    joint = scene.turning_joint()
    entries = {
        "joint": joint,
        "lines": float(scene.draw.integers(1000, 4000)),
        "amplitude_urad": scene.between(10.0, 100.0),
    }
    return Unlisted("subdivision_error", entries, ())


def four_bar(scene: Scene) -> Unlisted:
    """0.1 to 1 mrad at joint 3, driven by joint 2."""
    entries = {
        "joint": 3,
        "driven_by": 2,
        "amplitude_mrad": scene.between(0.1, 1.0),
        "phase_deg": scene.phase(),
    }
    return Unlisted("four_bar", entries, ("joint2",), (("joint_coupling", 3),))


def station_sway(scene: Scene) -> Unlisted:
    """0.05 to 0.3 mm, with a period of a fifth to half of the campaign."""
    period = float(scene.draw.uniform(0.2, 0.5)) * scene.duration_s
    entries = {"sway_mm": scene.direction(scene.between(0.05, 0.3)), "period_s": period}
    return Unlisted("station_sway", entries, ("time",))


def gripper_sag(scene: Scene) -> Unlisted:
    """0.05 to 0.4 mm at 4 kg."""
    entries = {"shift_mm": scene.direction(scene.between(0.05, 0.4)), "full_kg": 4.0}
    return Unlisted("gripper_sag", entries, ("payload",))


def tool_heat(scene: Scene) -> Unlisted:
    """3 to 30 micrometres a kelvin."""
    entries = {"shift_um_per_k": scene.direction(scene.between(3.0, 30.0))}
    return Unlisted("tool_heat", entries, ("temperature",))


def target_acceptance(scene: Scene) -> Unlisted:
    """20 to 200 micrometres between a target that faces the beam and one across it."""
    joints = tuple(f"joint{j}" for j in range(1, scene.table.n_joints + 1))
    entries = {"depth_um": scene.between(20.0, 200.0)}
    return Unlisted("target_acceptance", entries, ("orientation", *joints))


CAUSES: dict[str, Callable[[Scene], Unlisted]] = {
    draw.__name__: draw
    for draw in (
        hysteresis,
        axis_wobble,
        stiffening_compliance,
        bearing_compliance,
        subdivision_error,
        four_bar,
        station_sway,
        gripper_sag,
        tool_heat,
        target_acceptance,
    )
}

"""A calibrated robot taken to another station: base and tool fitted to a few poses, the rest kept.

What the robot itself does (geometry, gears, stiffness) goes with it; what belonged to the earlier
session does not: drift and steps of station and tool, the instrument, warming up by the clock. A
joint zero that jumped stays where it jumped to.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.calibrated import CalibratedRobot, Provenance
from robocal.diagnosis.extended import FittedEffect
from robocal.errors import BadInput
from robocal.formats.bundle import Bundle, RejectedRow
from robocal.frames_fit import (
    FittedFrames,
    FramesProblem,
    fit_frames,
    fit_without_outliers,
    frames_adequacy,
    moves_with_robot,
    without_effects,
)
from robocal.identification.adequacy import Adequacy
from robocal.identification.cell_model import CellModel
from robocal.identification.identify import summarise
from robocal.identification.observations import Observations
from robocal.identification.outliers import named_outliers
from robocal.identification.prepared import Prepared, prepare
from robocal.identification.priors import Choices
from robocal.identification.result import ResidualSummary
from robocal.identification.simultaneous import identify_simultaneously
from robocal.identification.solve import frames_problem
from robocal.kinematics.model import parameter_names
from robocal.robots.robot import Robot

OF_THE_SESSION = frozenset({
    "base_drift",
    "base_step",
    "tool_step",
    "warm_up",
    "instrument_scale",
    "instrument_angle",
})
_JUMPED = "encoder_step"
"""Its end is where the joint zero stays."""
_WORSE = 0.02
"""Share of the squared residual that an effect has to cost to be left behind; [1]"""


@dataclass(frozen=True)
class Stationed:
    """The robot at its new station, and how well it fits there."""

    calibrated: CalibratedRobot
    fit: ResidualSummary
    held_out: ResidualSummary | None
    adequacy: Adequacy
    """Of the rows that took part, whatever was said of the model before."""
    outliers: tuple[RejectedRow, ...]
    left_behind: tuple[str, ...]
    """Effects of the earlier session, which the new model lacks."""


def on_known_robot(calibrated: CalibratedRobot, bundle: Bundle) -> Bundle:
    """The bundle with the calibrated robot, as its earlier session ended, for the nominal one.

    Raises
    ------
    BadInput
        If the bundle is of a robot with other joints.
    """
    known = calibrated.robot
    if not np.array_equal(known.geometry.prismatic, bundle.robot.geometry.prismatic):
        raise BadInput(
            "robot.yaml",
            f"robot '{bundle.robot.name}' has {_joints_of(bundle.robot)}, the model is of "
            f"'{known.name}' with {_joints_of(known)}; give a bundle measured on that robot",
        )
    geometry = replace(known.geometry, links=_links_now(calibrated))
    return replace(bundle, robot=replace(known, geometry=geometry))


def station(calibrated: CalibratedRobot, bundle: Bundle, provenance: Provenance) -> Stationed:
    """Fit base, tool and nests alone to the fit rows of a bundle.

    Parameters
    ----------
    calibrated
        As learnt elsewhere.
    bundle
        The same robot, measured where it stands now.
    provenance
        Of the new model, which is as adequate as it is here, and never more than it was elsewhere.

    Raises
    ------
    BadInput
        If the bundle is of another robot, its rows do not show base and tool, or they lack a
        column that an effect of the model needs.
    """
    bundle = on_known_robot(calibrated, bundle)
    kept = tuple(f for f in calibrated.effects if f.instance.effect not in OF_THE_SESSION)
    lasting = tuple(f for f in kept if f.instance.effect != _JUMPED)
    links = parameter_names(bundle.robot.n_joints)[: 5 * bundle.robot.n_joints]
    ready = prepare(bundle, Choices(fixed=frozenset(links)))
    try:
        replace(calibrated, effects=lasting).poses_of(ready.rows)
    except BadInput as error:
        raise error.within("measurements.csv") from None
    problem = _problem(calibrated, bundle, ready)
    clean = problem.choose(fit_without_outliers(problem, lasting).used)
    carried = _carried_over(clean, lasting)
    moved = fit_without_outliers(problem, carried)
    there = _there(calibrated, bundle, problem.choose(moved.used), moved.frames, carried)
    adequacy = frames_adequacy(there, problem.choose(moved.used), moved.frames)
    stated = _never_better(provenance.judged_by(adequacy), calibrated.provenance)
    held_out = ready.rows.held_out
    fitted = ~held_out
    fitted[fitted] = moved.used
    gone = [f for f in calibrated.effects if f not in carried and f.instance.effect != _JUMPED]
    return Stationed(
        replace(there, provenance=stated),
        _summary(there, ready, problem.choose(moved.used).rows, moved.frames.cell, fitted),
        _summary(there, ready, ready.observe(bundle, held_out), moved.frames.cell, held_out)
        if held_out.any()
        else None,
        adequacy,
        named_outliers(ready.rows.lines[~held_out], moved.scores, ~moved.used),
        tuple(fitted.instance.title for fitted in gone),
    )


def _problem(calibrated: CalibratedRobot, bundle: Bundle, ready: Prepared) -> FramesProblem:
    """The rows to fit, and where frames without any effect begin."""
    rows = ready.observe(bundle, ~ready.rows.held_out)
    alone = frames_problem(ready.start, rows, ready.choices)
    cell = identify_simultaneously(alone).cell
    model = cell.geometry.with_frames_as_origin()
    around = replace(calibrated, model=model).circumstances_of(ready.rows.fit_rows)
    return FramesProblem(cell, rows, around, alone.free)


def _carried_over(
    problem: FramesProblem, effects: tuple[FittedEffect, ...]
) -> tuple[FittedEffect, ...]:
    """Leave behind, kind by kind and joint by joint, what makes the new rows fit worse.

    What depended on the earlier station, an instrument's circle taken for a gear of joint 1 say,
    shows by that; no number is fitted, so few rows tell.
    """
    now = fit_frames(problem, effects).chi_square
    while True:
        places = dict.fromkeys((f.instance.effect, f.instance.joint) for f in effects)
        tried = [
            tuple(f for f in effects if (f.instance.effect, f.instance.joint) != place)
            for place in places
        ]
        found = [fit_frames(problem, rest).chi_square for rest in tried]
        if not found or min(found) > (1.0 - _WORSE) * now:
            return effects
        best = int(np.argmin(found))
        effects, now = tried[best], found[best]


def _there(
    calibrated: CalibratedRobot,
    bundle: Bundle,
    problem: FramesProblem,
    frames: FittedFrames,
    carried: tuple[FittedEffect, ...],
) -> CalibratedRobot:
    """The robot in its new frames, which share the errors of its links and effects.

    Parameters
    ----------
    problem
        The rows that took part.
    """
    names, links = len(frames.cell.names), np.arange(5 * bundle.robot.n_joints)
    kept = _kept(calibrated, carried)
    stood = np.concatenate([links, kept])
    known = np.concatenate([links, names + np.arange(len(kept))])
    robot = calibrated.joint_covariance[np.ix_(stood, stood)]
    free, moved = problem.free, moves_with_robot(problem, frames, carried)
    whole = np.zeros((names + len(kept), names + len(kept)))
    whole[np.ix_(known, known)] = robot
    whole[np.ix_(free, known)] = moved @ robot
    whole[np.ix_(known, free)] = robot @ moved.T
    whole[np.ix_(free, free)] = frames.covariance + moved @ robot @ moved.T
    of_robot, of_coefficients, of_nests = frames.cell.covariances_at_origin(whole)
    return replace(
        calibrated,
        model=frames.cell.geometry.with_frames_as_origin(),
        covariance=of_robot,
        gravity=bundle.gravity,
        effects=carried,
        targets=frames.cell.targets,
        tool_known=bundle.tool_known,
        tool_rotation_known=bundle.tool_rotation_known,
        base_rotation_known=bundle.base_rotation_known,
        coefficient_covariance=of_coefficients,
        nest_covariance=of_nests,
    )


def _summary(
    there: CalibratedRobot,
    ready: Prepared,
    rows: Observations,
    cell: CellModel,
    chosen: Bool[Array, "row"],
) -> ResidualSummary:
    """What is left of some rows, each with its true predecessor."""
    around = there.circumstances_of(ready.rows).rows(chosen)
    return summarise(cell, without_effects(cell, rows, around, there.effects))


def _never_better(found: Provenance, learnt: Provenance) -> Provenance:
    """The verdict found here, unless the robot was called inadequate where it was learnt."""
    worse = learnt.inadequate and not found.inadequate
    return replace(found, adequacy=learnt.adequacy) if worse else found


def _joints_of(robot: Robot) -> str:
    """How many joints, and which of them slide: `4 joints (3 prismatic)`."""
    sliding = [str(joint + 1) for joint in np.flatnonzero(robot.geometry.prismatic)]
    kinds = f" ({', '.join(sliding)} prismatic)" if sliding else ""
    return f"{robot.n_joints} joints{kinds}"


def _links_now(calibrated: CalibratedRobot) -> Float[Array, "joint 5"]:
    """Links with the joint zeros where they were at the end of the earlier session."""
    links = calibrated.model.links.copy()
    for fitted in calibrated.effects:
        joint = fitted.instance.joint
        if fitted.instance.effect == _JUMPED and joint is not None:
            links[joint - 1, int(calibrated.model.prismatic[joint - 1])] += fitted.values[0]
    return links


def _kept(calibrated: CalibratedRobot, carried: tuple[FittedEffect, ...]) -> Int[Array, "kept"]:
    """Where the coefficients of the effects that came along stand in the joint covariance."""
    came = [np.full(len(fitted.values), fitted in carried) for fitted in calibrated.effects]
    n = len(calibrated.covariance)
    return n + np.flatnonzero(np.concatenate([np.zeros(0, dtype=bool), *came]))

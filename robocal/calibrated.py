"""The calibrated robot as others use it: identified model, covariance, provenance."""

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.linalg import block_diag

from robocal.diagnosis.circumstances import Circumstances, circumstances
from robocal.diagnosis.extended import FittedEffect, coefficient_shifts, predict, refuse_lacking
from robocal.diagnosis.reference import Reference
from robocal.diagnosis.steps import is_step
from robocal.errors import BadInput
from robocal.frames import invert
from robocal.identification.adequacy import Adequacy
from robocal.kinematics.forward import blocks, forward_kinematics
from robocal.kinematics.jacobian import pose_jacobian
from robocal.kinematics.model import KinematicModel
from robocal.measurements import MeasurementSet
from robocal.robots.robot import Robot

UNKNOWN_ROTATION = (
    "how the tool is turned in the flange is not known, as no orientation of it was fitted and "
    "campaign.yaml states no tool_guess"
)
"""What there is to say where `tool_rotation_known` is False."""
UNKNOWN_BASE_ROTATION = (
    "how the base is turned about the anchor is not known, as lengths from one anchor do not tell "
    "it and campaign.yaml states no base_guess; places in the measuring frame are those of any turn"
)
"""What there is to say where `base_rotation_known` is False."""
_BY_THE_CLOCK = frozenset({"base_drift", "warm_up"})
"""Effects that go with the time of the campaign, beside steps."""
_BLOCK = 500
"""Poses whose Jacobians are held at once."""


@dataclass(frozen=True)
class StatedAdequacy:
    """What was said of a model when it was made."""

    adequate: bool
    reduced_chi_square: float | None
    """None where no measured number was left over to judge it by."""

    @property
    def warning(self) -> str:
        """What to tell whoever uses a model that is not adequate."""
        value = self.reduced_chi_square
        if value is None:
            return (
                "no measured number was left over to judge this model by; measure more poses and "
                "run robocal diagnose on them before it is used"
            )
        misses = "leaves more than" if value > 1.0 else "leaves far less than"
        return (
            f"this model is not adequate: it {misses} the noise that its campaign declared "
            f"(reduced chi-square {value:.3g}); robocal diagnose on its bundle says why"
        )


@dataclass(frozen=True)
class Provenance:
    """Where a model comes from, so that it can be computed again."""

    bundle_sha256: str
    software_version: str
    date: str
    strategy: str
    adequacy: StatedAdequacy | None = None
    """None where nothing was said: a model from before it was kept."""

    @property
    def inadequate(self) -> bool:
        """Whether the model was found not to explain its own readings."""
        return self.adequacy is not None and not self.adequacy.adequate

    def judged_by(self, found: Adequacy) -> "Provenance":
        """The same with what its fit says of the model."""
        value = found.reduced_chi_square if found.nu > 0 else None
        return replace(self, adequacy=StatedAdequacy(found.adequate, value))


@dataclass(frozen=True)
class CalibratedRobot:
    """What `model.yaml` holds.

    Parameters
    ----------
    robot
        Nominal robot.
    model
        Identified geometry; `base` and `tool` are zero, the identified frames stand in `station`
        and `flange`.
    covariance
        Of all parameters [m, rad], zero for those that were not identified; the frames' part is in
        small shifts and turns along the frame's own axes.
    gravity
        Direction of gravity in the robot base.
    effects
        What acts besides the geometry, and what its times and temperatures are counted from.
    targets
        Places of the nests on the tool by name, in the robot's flange frame [m].
    tool_known
        False where nests alone were measured and nobody stated a tool: `model` then ends anywhere.
    tool_rotation_known
        False where no orientation of the tool was fitted and nobody stated one: `model` then ends
        in the right place with any axes, those of the flange.
    base_rotation_known
        False where lengths from one anchor alone were fitted and nobody stated a base: `model` then
        stands turned about the anchor anyhow, with the axes of the measuring frame.
    coefficient_covariance
        Of the effects' coefficients, one after the other, with all parameters and then with each
        other [m, rad and the coefficients' own units]; None where only their own is known.
    nest_covariance
        Of the nests' coordinates, in the order of `targets`, with all parameters, all coefficients
        and then with each other, zero for those that somebody stated; None where only their places
        are known, in models written before it was kept.
    """

    robot: Robot
    model: KinematicModel
    covariance: Float[Array, "parameter parameter"]
    gravity: Float[Array, "3"]
    provenance: Provenance
    effects: tuple[FittedEffect, ...] = ()
    reference: Reference = field(default_factory=Reference)
    targets: dict[str, Float[Array, "3"]] = field(default_factory=dict)
    tool_known: bool = True
    tool_rotation_known: bool = True
    base_rotation_known: bool = True
    coefficient_covariance: Float[Array, "coefficient unknown"] | None = None
    nest_covariance: Float[Array, "coordinate everything"] | None = None

    @property
    def joint_covariance(self) -> Float[Array, "unknown unknown"]:
        """Of all parameters and, after them, of the effects' coefficients."""
        n = len(self.covariance)
        own = [fitted.covariance for fitted in self.effects]
        joint = block_diag(self.covariance, *own)
        if self.coefficient_covariance is not None and own:
            joint[n:] = self.coefficient_covariance
            joint[:n, n:] = joint[n:, :n].T
        return np.asarray(joint)

    @property
    def whole_covariance(self) -> Float[Array, "everything everything"]:
        """Of all parameters, the effects' coefficients and, after them, the nests' coordinates."""
        joint, k = self.joint_covariance, 3 * len(self.targets)
        n, whole = len(joint), block_diag(joint, np.zeros((k, k)))
        if self.nest_covariance is not None:
            whole[n:] = self.nest_covariance
            whole[:n, n:] = whole[n:, :n].T
        return np.asarray(whole)

    def tool_poses(self, q: Float[Array, "pose joint"]) -> Float[Array, "pose 4 4"]:
        """Target poses in the measuring frame at joint readings [rad or m], by geometry alone."""
        return forward_kinematics(self.model, q)

    def poses_of(self, rows: MeasurementSet) -> Float[Array, "row 4 4"]:
        """Target poses of rows with all effects acting; what was measured in them is ignored.

        Rows stand where in the model's campaign their time says, at its end where they state none.

        Raises
        ------
        BadInput
            If an effect depends on a column that the rows lack.
        """
        return self._poses(rows, self.model)

    def target_poses(self, rows: MeasurementSet) -> Float[Array, "row 4 4"]:
        """Like `poses_of`, of the nest that each row names; a nest has the flange's axes.

        Raises
        ------
        BadInput
            Also if a row names a nest that the model does not know.
        """
        T = np.empty((len(rows), 4, 4))
        for name, chosen in self.rows_by_target(rows).items():
            T[chosen] = self._poses(rows, self.model_at(name))[chosen]
        return T

    def rows_by_target(self, rows: MeasurementSet) -> dict[str, Bool[Array, "row"]]:
        """Which rows mean which nest; the tool itself goes by no name.

        Raises
        ------
        BadInput
            If a row names a nest that the model does not know, or none where it knows no tool.
        """
        known = ", ".join(self.targets) or "none"
        for line, name in zip(rows.lines, rows.target, strict=True):
            if name and name not in self.targets:
                raise BadInput(
                    f"line {line}", f"target '{name}' is not in the model (its nests: {known})"
                )
            if not name and not self.tool_known:
                raise BadInput(
                    f"line {line}",
                    f"names no target, and the model knows nests alone: put one of {known} into "
                    "column 'target'",
                )
        named = np.array(rows.target)
        return {str(name): named == name for name in dict.fromkeys(rows.target)}

    def unturned(self, rows: MeasurementSet) -> Bool[Array, "row"]:
        """Rows of the tool where nothing tells its rotation; a nest has the flange's axes."""
        of_tool = np.array([not name for name in rows.target], dtype=bool)
        return of_tool & (not self.tool_rotation_known)

    def model_at(self, name: str) -> KinematicModel:
        """The model with its target at a nest; at the tool for no name."""
        if not name:
            return self.model
        place = np.eye(4)
        place[:3, 3] = self.targets[name]
        return replace(self.model, flange=self.robot.geometry.flange @ place, tool=np.zeros(6))

    def _poses(self, rows: MeasurementSet, model: KinematicModel) -> Float[Array, "row 4 4"]:
        T = forward_kinematics(model, rows.joints)
        if not self.effects:
            return T
        around = self.circumstances_of(replace(rows, position=T[:, :3, 3]))
        refuse_lacking(around, self.effects, rows.lines)
        target = predict(model, around, self.effects)
        for position, axis in enumerate((target.x, target.y, target.z, target.p)):
            T[:, :3, position] = axis.T
        return T

    def rows_at_end(self, rows: MeasurementSet) -> Bool[Array, "row"]:
        """Rows taken as at the end of the model's campaign, as nothing tells when they are."""
        instances = [fitted.instance for fitted in self.effects]
        steps = any(is_step(instance) for instance in instances)
        if not steps and not any(instance.effect in _BY_THE_CLOCK for instance in instances):
            return np.zeros(len(rows), dtype=bool)
        told = self.reference.moments or not steps
        return ~(self.reference.places(rows.time) & bool(told))

    def circumstances_of(self, rows: MeasurementSet) -> Circumstances:
        """What the effects see of rows."""
        tool = invert(self.robot.geometry.flange) @ self.model.tool_frame
        base = self.model.base_frame[:3, :3]
        return circumstances(self.robot, self.gravity, tool[:3, 3], base, rows, self.reference)

    def tool_position_covariance(self, q: Float[Array, "pose joint"]) -> Float[Array, "pose 3 3"]:
        """Covariance of the target's position [m2] by geometry alone (GUM, 5.1.2)."""
        result = np.empty((len(q), 3, 3))
        for block in blocks(len(q), _BLOCK):
            result[block] = _propagated(_position_jacobian(self.model, q[block]), self.covariance)
        return result

    def position_covariance_of(self, rows: MeasurementSet) -> Float[Array, "row 3 3"]:
        """Covariance of the targets of rows [m2], by geometry and effects together.

        What an effect and the geometry have in common the fit leaves open between them, and in
        their sum it cancels: so it takes their joint covariance (GUM, 5.2.2). NaN where the base's
        rotation is not known: no place in the measuring frame is; and of a nest in a model that was
        written before nests had a covariance.

        Raises
        ------
        BadInput
            If a row names a nest that the model does not know.
        """
        if not self.base_rotation_known:
            return np.full((len(rows), 3, 3), np.nan)
        result, whole = np.full((len(rows), 3, 3), np.nan), self.whole_covariance
        for name, chosen in self.rows_by_target(rows).items():
            if name and self.nest_covariance is None:
                continue
            T = forward_kinematics(self.model_at(name), rows.joints)
            around = self.circumstances_of(replace(rows, position=T[:, :3, 3]))
            here = np.flatnonzero(chosen)
            for block in blocks(len(here), _BLOCK):
                moves = self._moves_at(name, rows.joints[here[block]], around.rows(here[block]))
                result[here[block]] = _propagated(moves, whole)
        return result

    def _moves_at(
        self, name: str, q: Float[Array, "pose joint"], around: Circumstances
    ) -> Float[Array, "pose unknown 3"]:
        """How the target moves with everything that `whole_covariance` is of."""
        J = _position_jacobian(self.model_at(name), q)
        shifts = coefficient_shifts(J, around, self.effects)
        nests = np.zeros((len(q), 3 * len(self.targets), 3))
        if name:
            # The nest stands in the tool's stead, and moves along the flange's axes.
            first = 3 * list(self.targets).index(name)
            nests[:, first : first + 3] = J[:, -6:-3]
            J[:, -6:] = 0.0
        return np.concatenate([J, shifts, nests], axis=1)


def _position_jacobian(
    model: KinematicModel, q: Float[Array, "pose joint"]
) -> Float[Array, "pose parameter 3"]:
    _, J = pose_jacobian(model, q)
    return np.moveaxis(J[:, :3], 2, 0)


def _propagated(
    J: Float[Array, "pose unknown 3"], covariance: Float[Array, "unknown unknown"]
) -> Float[Array, "pose 3 3"]:
    return np.asarray(np.einsum("mpi,pk,mkj->mij", J, covariance, J, optimize=True))

"""`model.yaml`: a calibrated robot in one self-contained file."""

from pathlib import Path

import numpy as np
import yaml
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.calibrated import CalibratedRobot, Provenance
from robocal.diagnosis.extended import FittedEffect
from robocal.diagnosis.reference import Reference
from robocal.formats.effects_yaml import (
    effect_document,
    read_effect,
    read_reference,
    reference_document,
)
from robocal.formats.fields import Fields, fields_of, read_text
from robocal.formats.provenance_yaml import provenance_document, read_provenance
from robocal.formats.robot_yaml import (
    frame_document,
    link_document,
    read_frame,
    robot_document,
    robot_from_fields,
)
from robocal.formats.whole_file import write_whole
from robocal.frames import frame_from_xyz_ypr, invert
from robocal.identification.result import Identification
from robocal.kinematics.model import KinematicModel, parameter_is_angle, parameter_names
from robocal.robots.robot import Robot

FORMAT = "robocal-model-1"
_DEG = np.pi / 180.0
_COEFFICIENTS = "coefficients_with_parameters_and_each_other"
_NESTS = "nests_with_parameters_coefficients_and_each_other"


def calibrated_robot(
    robot: Robot, result: Identification, gravity: Float[Array, "3"], provenance: Provenance
) -> CalibratedRobot:
    """The identified robot with its covariance."""
    return CalibratedRobot(
        robot,
        result.model,
        result.full_covariance(),
        gravity,
        provenance.judged_by(result.adequacy),
        targets=result.cell.targets,
        tool_known=result.tool_known,
        tool_rotation_known=result.tool_rotation_known,
        base_rotation_known=result.base_rotation_known,
        nest_covariance=result.nest_covariance(),
    )


def model_document(calibrated: CalibratedRobot) -> dict[str, object]:
    """Content of `model.yaml`; angles in deg, lengths in mm."""
    model = calibrated.model
    names = parameter_names(model.n_joints)
    known = np.flatnonzero(np.diag(calibrated.covariance) > 0)
    unit = np.where(parameter_is_angle(model.n_joints), _DEG, 1e-3)[known]
    covariance = calibrated.covariance[np.ix_(known, known)] / np.outer(unit, unit)
    return {
        "format": FORMAT,
        "robot": robot_document(calibrated.robot),
        "links": [link_document(link) for link in model.links],
        "base": frame_document(model.base_frame),
        "tool": frame_document(invert(calibrated.robot.geometry.flange) @ model.tool_frame),
        "tool_known": calibrated.tool_known,
        "tool_rotation_known": calibrated.tool_rotation_known,
        "base_rotation_known": calibrated.base_rotation_known,
        "targets": {
            name: {"xyz_mm": [float(value) * 1e3 for value in place]}
            for name, place in calibrated.targets.items()
        },
        "gravity": [float(value) for value in calibrated.gravity],
        "effects": [effect_document(fitted) for fitted in calibrated.effects],
        "reference": reference_document(calibrated.reference, calibrated.effects),
        "covariance": {
            "parameters": [names[k] for k in known],
            "matrix_deg_mm": [[float(value) for value in row] for row in covariance],
            **_coefficients(calibrated, known, unit),
            **_nests(calibrated, known, unit),
        },
        "provenance": provenance_document(calibrated.provenance),
    }


def write_model(path: Path, calibrated: CalibratedRobot) -> None:
    """Write `model.yaml`."""
    write_whole(path, model_text(calibrated))


def model_text(calibrated: CalibratedRobot) -> str:
    """`model.yaml` as it stands in the file."""
    document = model_document(calibrated)
    return yaml.safe_dump(document, sort_keys=False, default_flow_style=None, width=120)


def read_model(path: Path) -> CalibratedRobot:
    """A calibrated robot from `model.yaml`.

    Raises
    ------
    BadInput
        Naming line and field.
    """
    return calibrated_from_fields(fields_of(path.name, read_text(path)), path.parent)


def model_from_document(document: dict[str, object]) -> CalibratedRobot:
    """A calibrated robot from the content of a `model.yaml`."""
    return calibrated_from_fields(
        fields_of("model.yaml", yaml.safe_dump(document, sort_keys=False)), Path()
    )


def calibrated_from_fields(fields: Fields, folder: Path) -> CalibratedRobot:
    """A calibrated robot from an open mapping."""
    if fields.text("format") != FORMAT:
        raise fields.error("format", f"must be {FORMAT}")
    nominal = fields.mapping("robot")
    robot = robot_from_fields(nominal, folder)
    nominal.finish()
    rows = fields.mappings("links")
    if len(rows) != robot.n_joints:
        raise fields.error("links", f"must have {robot.n_joints} rows, not {len(rows)}")
    model = KinematicModel(
        links=np.array([_link(row) for row in rows]),
        prismatic=robot.geometry.prismatic,
        station=_frame(fields, "base"),
        mount=robot.geometry.mount,
        flange=robot.geometry.flange @ _frame(fields, "tool"),
    )
    effects: tuple[FittedEffect, ...] = ()
    if "effects" in fields and not fields.is_empty_list("effects"):
        effects = tuple(read_effect(entry) for entry in fields.mappings("effects"))
    reference = Reference()
    if "reference" in fields:
        reference = read_reference(fields.mapping("reference"), effects)
    provenance = read_provenance(fields.mapping("provenance"))
    stated = fields.mapping("covariance")
    among = _coefficient_covariance(stated, robot.n_joints, effects)
    targets = _targets(fields.mapping("targets")) if "targets" in fields else {}
    of_nests = _nest_covariance(stated, robot.n_joints, effects, 3 * len(targets))
    covariance = _covariance(stated, robot.n_joints)
    gravity = np.array(fields.numbers("gravity", 3))
    # Files from before these flags do not say; what they gave they go on giving.
    tool_known = fields.flag("tool_known", default=True)
    tool_rotation_known = fields.flag("tool_rotation_known", default=True)
    base_rotation_known = fields.flag("base_rotation_known", default=True)
    fields.finish()
    return CalibratedRobot(
        robot,
        model,
        covariance,
        gravity,
        provenance,
        effects,
        reference,
        targets,
        tool_known=tool_known,
        tool_rotation_known=tool_rotation_known,
        base_rotation_known=base_rotation_known,
        coefficient_covariance=among,
        nest_covariance=of_nests,
    )


def _targets(nests: Fields) -> dict[str, Float[Array, "3"]]:
    """Places of the nests [m]."""
    places = {}
    for name in nests.names():
        nest = nests.mapping(name)
        places[name] = np.array(nest.numbers("xyz_mm", 3)) * 1e-3
        nest.finish()
    nests.finish()
    return places


def _coefficients(
    calibrated: CalibratedRobot, known: Int[Array, "known"], unit: Float[Array, "known"]
) -> dict[str, list[str]]:
    """Covariance of each coefficient with the parameters listed, then with all coefficients.

    A row is one text, its numbers apart by blanks: a hundred rows of a hundred and forty numbers
    would take a YAML reader a second.
    """
    if not calibrated.effects:
        return {}
    n = len(calibrated.covariance)
    rows = calibrated.joint_covariance[n:]
    return {_COEFFICIENTS: _texts(np.concatenate([rows[:, known] / unit, rows[:, n:]], axis=1))}


def _nests(
    calibrated: CalibratedRobot, known: Int[Array, "known"], unit: Float[Array, "known"]
) -> dict[str, list[str]]:
    """Covariance of each nest's coordinate [mm], as that of the coefficients is written."""
    if calibrated.nest_covariance is None or not calibrated.targets:
        return {}
    n, last = len(calibrated.covariance), len(calibrated.joint_covariance)
    rows = calibrated.nest_covariance / 1e-3
    parts = [rows[:, known] / unit, rows[:, n:last], rows[:, last:] / 1e-3]
    return {_NESTS: _texts(np.concatenate(parts, axis=1))}


def _texts(rows: Float[Array, "row unknown"]) -> list[str]:
    return [" ".join(repr(float(value)) for value in row) for row in rows]


def _coefficient_covariance(
    fields: Fields, n_joints: int, effects: tuple[FittedEffect, ...]
) -> Float[Array, "coefficient unknown"] | None:
    """The same read back; None in models written before it was kept."""
    if _COEFFICIENTS not in fields:
        return None
    count = sum(len(fitted.values) for fitted in effects)
    return _rows(fields, _COEFFICIENTS, n_joints, np.ones(count), count)


def _nest_covariance(
    fields: Fields, n_joints: int, effects: tuple[FittedEffect, ...], count: int
) -> Float[Array, "coordinate everything"] | None:
    """That of the nests; None in models written before it was kept."""
    if _NESTS not in fields:
        return None
    coefficients = sum(len(fitted.values) for fitted in effects)
    units = np.concatenate([np.ones(coefficients), np.full(count, 1e-3)])
    return _rows(fields, _NESTS, n_joints, units, count) * 1e-3


def _rows(
    fields: Fields, name: str, n_joints: int, units: Float[Array, "other"], count: int
) -> Float[Array, "row unknown"]:
    """Covariances with the listed parameters, then with what has the given units."""
    known, is_angle = _listed(fields, n_joints), parameter_is_angle(n_joints)
    rows = fields.number_rows(name, count, len(known) + len(units))
    full = np.zeros((count, len(is_angle) + len(units)))
    full[:, known] = rows[:, : len(known)] * np.where(is_angle, _DEG, 1e-3)[known]
    full[:, len(is_angle) :] = rows[:, len(known) :] * units
    return full


def _link(row: Fields) -> list[float]:
    link = [
        row.number("theta_deg") * _DEG,
        row.number("d_mm") * 1e-3,
        row.number("a_mm") * 1e-3,
        row.number("alpha_deg") * _DEG,
        row.number("beta_deg") * _DEG,
    ]
    row.finish()
    return link


def _frame(fields: Fields, name: str) -> Float[Array, "4 4"]:
    frame = fields.mapping(name)
    values = read_frame(frame)
    frame.finish()
    return frame_from_xyz_ypr(values)


def _covariance(fields: Fields, n_joints: int) -> Float[Array, "parameter parameter"]:
    known, is_angle = _listed(fields, n_joints), parameter_is_angle(n_joints)
    unit = np.where(is_angle, _DEG, 1e-3)[known]
    matrix = np.array(fields.matrix("matrix_deg_mm", len(known), len(known)))
    fields.finish()
    full = np.zeros((len(is_angle), len(is_angle)))
    full[np.ix_(known, known)] = matrix.reshape(len(known), len(known)) * np.outer(unit, unit)
    return full


def _listed(fields: Fields, n_joints: int) -> list[int]:
    """Numbers of the parameters that the covariance speaks of."""
    names, listed = parameter_names(n_joints), fields.texts("parameters")
    for name in listed:
        if name not in names:
            raise fields.error("parameters", f"names '{name}', which is no parameter")
        if listed.count(name) > 1:
            raise fields.error("parameters", f"names '{name}' twice")
    return [names.index(name) for name in listed]

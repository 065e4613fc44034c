"""What a certificate is about: one version of a cell's parameters, or what an import gave.

A campaign gives several versions: of the geometry, with effects, and again after each repeated
computation. All that a certificate lists belongs to the one version that it names.
"""

from dataclasses import dataclass
from typing import Any

import yaml
from sqlalchemy import select
from sqlalchemy.orm import Session

from service.campaigns import results
from service.campaigns.results import ResultKind
from service.db.models import ParametersRow, ResultRow
from service.errors import Conflict, NotFound
from service.parameters.models import ParametersContent, ParametersState

Json = dict[str, Any]

_FURTHEST = (
    ParametersState.candidate,
    ParametersState.verified,
    ParametersState.superseded,
    ParametersState.released,
)


@dataclass(frozen=True)
class Subject:
    """Parameters with everything that was computed together with them."""

    row: ParametersRow | None
    """The version; None where there is no cell that could have one."""
    result: ResultRow
    """The identification, or with effects the diagnosis, from which the parameters come."""
    parameters: list[Json]
    residuals: Json
    uncertainty: Json
    model: Json

    @property
    def fit(self) -> Json | None:
        """The identification; None for parameters that come from a diagnosis."""
        return self.result.document if self.result.kind == ResultKind.identification else None


def subject(session: Session, campaign: int, version: int | None) -> Subject:
    """The version asked for, else the one that came furthest; raises `NotFound`, `Conflict`."""
    newest = results.newest(session, campaign, ResultKind.identification)
    row = _chosen(session, campaign, version)
    return _of_newest(session, newest) if row is None else _of_version(session, row)


def _chosen(session: Session, campaign: int, version: int | None) -> ParametersRow | None:
    rows = session.scalars(
        select(ParametersRow)
        .where(ParametersRow.campaign == campaign)
        .order_by(ParametersRow.version)
    ).all()
    if version is None:
        # Of those that came equally far, the newest.
        return max(rows, key=lambda row: (_FURTHEST.index(row.state), row.version), default=None)
    for row in rows:
        if row.version == version:
            return row
    there_are = ", ".join(str(row.version) for row in rows) or "none"
    raise NotFound(
        f"Version {version} of the parameters is not of campaign {campaign}, whose versions are: "
        f"{there_are}."
    )


def _of_version(session: Session, row: ParametersRow) -> Subject:
    content = ParametersContent.model_validate(row.document)
    with_effects = "effects" in content.provenance.settings
    kind = ResultKind.diagnosis if with_effects else ResultKind.identification
    result = session.scalars(
        select(ResultRow)
        .where(
            ResultRow.campaign == row.campaign,
            ResultRow.kind == kind,
            ResultRow.created == content.provenance.computed,
        )
        .order_by(ResultRow.id.desc())
        .limit(1)
    ).first()
    if result is None:
        raise Conflict(
            f"The result from which version {row.version} of cell '{row.cell}' comes is not in the "
            "database; identify again and certify the version that comes of it."
        )
    return Subject(
        row, result, content.parameters, content.residuals, content.uncertainty, content.model
    )


def _of_newest(session: Session, found: ResultRow) -> Subject:
    if found.model_yaml is None:
        raise Conflict("The identification has no model; identify again.")
    uncertainty = results.newest(session, found.campaign, ResultKind.uncertainty)
    return Subject(
        None,
        found,
        found.document["parameters"],
        found.document["residuals"],
        uncertainty.document,
        yaml.safe_load(found.model_yaml),
    )

"""Part `provenance` of `model.yaml`: where the model comes from, and what was said of it."""

from robocal.calibrated import Provenance, StatedAdequacy
from robocal.formats.fields import Fields

_VERDICTS = {True: "adequate", False: "inadequate"}


def provenance_document(provenance: Provenance) -> dict[str, object]:
    """As `model.yaml` holds it."""
    document: dict[str, object] = {
        "bundle_sha256": provenance.bundle_sha256,
        "software_version": provenance.software_version,
        "date": provenance.date,
        "strategy": provenance.strategy,
    }
    stated = provenance.adequacy
    if stated is not None:
        figure = stated.reduced_chi_square
        document["adequacy"] = {
            "verdict": _VERDICTS[stated.adequate],
            **({} if figure is None else {"reduced_chi_square": figure}),
        }
    return document


def read_provenance(fields: Fields) -> Provenance:
    """The same read back; files from before the adequacy was kept state none.

    Raises
    ------
    BadInput
        Naming line and field.
    """
    return Provenance(
        bundle_sha256=fields.text("bundle_sha256"),
        software_version=fields.text("software_version"),
        date=fields.text("date"),
        strategy=fields.text("strategy"),
        adequacy=_adequacy(fields.mapping("adequacy")) if "adequacy" in fields else None,
    )


def _adequacy(fields: Fields) -> StatedAdequacy:
    verdict = fields.text("verdict")
    if verdict not in _VERDICTS.values():
        raise fields.error("verdict", f"must be adequate or inadequate, not {verdict}")
    judged = "reduced_chi_square" in fields
    value = fields.number("reduced_chi_square") if judged else None
    fields.finish()
    return StatedAdequacy(verdict == _VERDICTS[True], value)

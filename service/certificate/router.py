"""REST: the certificate of a calibration, as HTML or PDF, and the report under its older name."""

from enum import StrEnum
from typing import Annotated

from fastapi import APIRouter, Header, Query, Response

from service.certificate.contents import contents
from service.certificate.document import certificate, certificate_pdf
from service.dependencies import DatabaseDependency, RowNumber

router = APIRouter(prefix="/campaigns/{campaign}/certificate", tags=["campaigns"])

_PDF, _HTML = "application/pdf", "text/html"


class CertificateFormat(StrEnum):
    """How a certificate is written."""

    html = "html"
    pdf = "pdf"


@router.get(
    "",
    response_class=Response,
    responses={200: {"content": {_HTML: {}, _PDF: {}}}},
)
def get_certificate(
    campaign: RowNumber,
    database: DatabaseDependency,
    version: Annotated[
        RowNumber | None,
        Query(description="of this campaign's parameters; else the one that came furthest"),
    ] = None,
    wanted: Annotated[CertificateFormat | None, Query(alias="format")] = None,
    accept: Annotated[str, Header()] = "*/*",
) -> Response:
    """Return the certificate of a version: HTML, or PDF by Accept or `?format=pdf`."""
    with database.read() as session:
        made = certificate(contents(session, campaign, version))
        if wanted is CertificateFormat.pdf or (wanted is None and _PDF in accept):
            name = f"certificate-{made.number}.pdf"
            return Response(
                certificate_pdf(made),
                media_type=_PDF,
                headers={"Content-Disposition": f'inline; filename="{name}"'},
            )
        return Response(
            made.html,
            media_type=_HTML,
            # The file brings its own style and nothing else.
            headers={"Content-Security-Policy": "default-src 'none'; style-src 'unsafe-inline'"},
        )

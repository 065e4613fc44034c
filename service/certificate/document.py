"""The certificate as HTML and as PDF: equal contents give equal bytes."""

import hashlib
from dataclasses import dataclass

from jinja2 import Environment, PackageLoader, StrictUndefined

from service.certificate.contents import COVERAGE, Contents

_SHOWN_DIGITS = 12


@dataclass(frozen=True)
class Certificate:
    """What is handed out."""

    number: str
    """The campaign, then the hash of everything else that is printed: who states something else,
    be it that the parameters were superseded, hands out another certificate."""
    html: str


def certificate(contents: Contents) -> Certificate:
    """The certificate as one HTML file without anything from outside."""
    environment = Environment(
        loader=PackageLoader("service.certificate", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["fixed"] = _fixed
    template = environment.get_template("certificate.html")
    printed = template.render(c=contents, k=COVERAGE, number="")
    digest = hashlib.sha256(printed.encode()).hexdigest()
    number = f"{contents.campaign.id}-{digest[:_SHOWN_DIGITS]}"
    return Certificate(number, template.render(c=contents, k=COVERAGE, number=number))


def certificate_pdf(made: Certificate) -> bytes:
    """The same as PDF; its identifier and dates come from the contents."""
    # Brings the system's Pango, which other calls do not need.
    from weasyprint import HTML

    page = HTML(string=made.html, url_fetcher=_nothing_from_outside)
    written: bytes = page.write_pdf(pdf_identifier=made.number.encode())
    return written


def _fixed(value: float | None, places: int) -> str:
    return "–" if value is None else f"{value:.{places}f}"


def _nothing_from_outside(url: str, *arguments: object, **options: object) -> dict[str, object]:
    raise ValueError(f"a certificate takes nothing from outside, and {url!r} is")

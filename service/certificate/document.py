"""The certificate as HTML and as PDF: equal contents give equal bytes."""

from jinja2 import Environment, PackageLoader, StrictUndefined

from service.certificate.contents import COVERAGE, Contents


def certificate_html(contents: Contents) -> str:
    """The certificate as one HTML file without anything from outside."""
    environment = Environment(
        loader=PackageLoader("service.certificate", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["fixed"] = _fixed
    return environment.get_template("certificate.html").render(c=contents, k=COVERAGE)


def certificate_pdf(contents: Contents) -> bytes:
    """The same as PDF; its identifier and dates come from the contents."""
    # Brings the system's Pango, which other calls do not need.
    from weasyprint import HTML

    page = HTML(string=certificate_html(contents), url_fetcher=_nothing_from_outside)
    made: bytes = page.write_pdf(pdf_identifier=contents.number.encode())
    return made


def _fixed(value: float | None, places: int) -> str:
    return "–" if value is None else f"{value:.{places}f}"


def _nothing_from_outside(url: str, *arguments: object, **options: object) -> dict[str, object]:
    raise ValueError(f"a certificate takes nothing from outside, and {url!r} is")

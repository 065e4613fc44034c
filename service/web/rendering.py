"""Templates to answers, with the headers that keep foreign code out of the pages."""

import json
from http import HTTPStatus

from fastapi.responses import HTMLResponse
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from service.web import assets, numbers
from service.web.words import LANGUAGE, WORDS

_POLICY = {
    "default-src": "'none'",
    "script-src": "'self'",
    "style-src": "'self'",
    # plotly.js draws its picture for download into such addresses.
    "img-src": "'self' data: blob:",
    "connect-src": "'self'",
    "form-action": "'self'",
    "base-uri": "'none'",
    "frame-ancestors": "'none'",
}
HEADERS = {
    "Content-Security-Policy": "; ".join(f"{name} {source}" for name, source in _POLICY.items()),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",
    "Cache-Control": "no-store",
}


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("service.web"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.globals.update(
        w=WORDS,
        language=LANGUAGE,
        words_json=_for_script(WORDS),
        page_asset=assets.collection(assets.PAGES).address,
        style_marks=assets.style_marks(),
        plotly_address=assets.collection(assets.PLOTLY).address("plotly.min.js"),
    )
    environment.filters.update(
        fixed=numbers.fixed,
        nominal=numbers.nominal,
        moment=_moment,
    )
    return environment


def _for_script(words: dict[str, str]) -> Markup:
    # Inside a script element only "</" could end it early.
    return Markup(json.dumps(words, ensure_ascii=False).replace("<", "\\u003c"))


def _moment(stored: str) -> str:
    """Show a stored time without its seconds."""
    return f"{stored[:10]} {stored[11:16]} UTC"


_templates = _environment()


def page(template: str, status: HTTPStatus = HTTPStatus.OK, **content: object) -> HTMLResponse:
    """Make a page, or a part of one, from a template."""
    text = _templates.get_template(template).render(**content)
    return HTMLResponse(text, status_code=status, headers=HEADERS)

"""Templates to answers, with the headers that keep foreign code out of the pages."""

import json
from http import HTTPStatus

from fastapi.responses import HTMLResponse
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from service.access.caller import CURRENT
from service.access.secrets import form_token
from service.web import assets, numbers, preferences
from service.web.words import LANGUAGES

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
        language_names={code: words["language_name"] for code, words in LANGUAGES.items()},
        themes=tuple(preferences.Theme),
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
_WORDS_JSON = {code: _for_script(words) for code, words in LANGUAGES.items()}


def page(template: str, status: HTTPStatus = HTTPStatus.OK, **content: object) -> HTMLResponse:
    """Make a page, or a part of one, from a template."""
    caller = CURRENT.get()
    token = form_token(caller.login_token) if caller.login_token else ""
    wanted = preferences.CURRENT.get()
    text = _templates.get_template(template).render(
        caller=caller,
        form_token=token,
        w=LANGUAGES[wanted.language],
        words_json=_WORDS_JSON[wanted.language],
        language=wanted.language,
        theme=wanted.theme,
        **content,
    )
    return HTMLResponse(text, status_code=status, headers=HEADERS)

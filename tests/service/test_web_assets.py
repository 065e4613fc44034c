"""Style, scripts and plotly.js: compressed, cacheable, whole, and from nowhere else."""

import gzip
import re
from pathlib import Path

import httpx
import plotly
import pytest

import service.web

STATIC = Path(service.web.__file__).parent / "static"
TEMPLATES = Path(service.web.__file__).parent / "templates"
PLOTLY = Path(plotly.__file__).parent / "package_data" / "plotly.min.js"


def assets_of(page: str) -> dict[str, str]:
    """Addresses on a page by the file's name."""
    return {address.rsplit("/", 1)[1]: address for address in re.findall(r"/assets/[^\"]+", page)}


def plotly_address(site: httpx.Client, client: httpx.Client, cell: dict) -> str:
    body = {"cell": cell["name"], "kind": "calibrate", "poses": 8}
    number = client.post("campaigns", json=body).json()["id"]
    return assets_of(site.get(f"/campaigns/{number}").text)["plotly.min.js"]


def test_plotly_comes_compressed_from_its_own_package(site, client, cell):
    address = plotly_address(site, client, cell)
    with site.stream("GET", address, headers={"Accept-Encoding": "gzip"}) as answer:
        sent = b"".join(answer.iter_raw())
    assert answer.headers["content-encoding"] == "gzip"
    assert len(sent) < 1.6e6
    assert gzip.decompress(sent) == PLOTLY.read_bytes()


def test_a_client_without_gzip_gets_the_same_file(site, client, cell):
    address = plotly_address(site, client, cell)
    answer = site.get(address, headers={"Accept-Encoding": "identity"})
    assert "content-encoding" not in answer.headers
    assert answer.headers["vary"] == "Accept-Encoding"
    assert answer.content == PLOTLY.read_bytes()


def test_an_asset_is_fetched_once_and_kept(site):
    address = assets_of(site.get("/").text)["home.js"]
    first = site.get(address)
    assert "immutable" in first.headers["cache-control"]
    assert first.headers["content-type"].startswith("text/javascript")
    assert first.headers["x-content-type-options"] == "nosniff"
    again = site.get(address, headers={"If-None-Match": first.headers["etag"]})
    assert again.status_code == 304
    assert again.content == b""


@pytest.mark.parametrize(
    "address",
    [
        "/assets/pages/0123456789abcdef/home.js",
        "/assets/{version}/nothing.js",
        "/assets/{version}/..%2Fwords.py",
        "/assets/{version}/%2e%2e/words.py",
        "/assets/elsewhere/1/home.js",
    ],
)
def test_nothing_else_is_served(site, address):
    version = assets_of(site.get("/").text)["home.js"].split("/assets/")[1].rsplit("/", 1)[0]
    assert site.get(address.format(version=version)).status_code == 404


def test_every_module_that_a_script_imports_is_there():
    for script in STATIC.glob("*.js"):
        for name in re.findall(r'from "\./([^"]+)"', script.read_text(encoding="utf-8")):
            assert (STATIC / name).is_file(), f"{script.name} imports {name}"


def test_scripts_styles_and_templates_name_no_other_host():
    for path in (*STATIC.iterdir(), *TEMPLATES.iterdir()):
        text = path.read_text(encoding="utf-8").replace("http://www.w3.org/2000/svg", "")
        assert not re.search(r"https?://|(?<=[\"'(])//\w", text), path.name


def test_scripts_are_short_enough_to_hold_one_idea():
    for script in STATIC.glob("*.js"):
        assert len(script.read_text(encoding="utf-8").splitlines()) < 250, script.name


def test_no_form_can_be_sent_before_its_code_is_there():
    forms = [
        form
        for file in STATIC.with_name("templates").glob("*.html")
        for form in re.findall(r"<form.*?</form>", file.read_text(encoding="utf-8"), re.DOTALL)
    ]
    scripted = [form for form in forms if "method=" not in form.partition(">")[0]]
    assert len(scripted) >= 8
    for form in scripted:
        assert re.findall(r'type="submit"(.{20})', form) == [" disabled data-waits"]

"""Logging in with a real browser: who is nobody sees nothing, who is somebody sees who he is."""

import os
import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import BrowserContext, Page, Route, expect

from tests.acceptance.test_page import PATIENCE_MS
from tests.credentials import PASSWORD
from tests.integration.service_cell import ROOT, Site, installation

SCREENSHOT = ROOT / "docs" / "images" / "access.png"


@pytest.fixture(scope="module")
def service(tmp_path_factory) -> Iterator[Site]:
    with installation(tmp_path_factory.mktemp("access"), workers=0) as running:
        yield running


@pytest.fixture
def stranger(browser) -> Iterator[BrowserContext]:
    """A browser in which nobody is logged in."""
    with browser.new_context(viewport={"width": 1280, "height": 900}) as context:
        yield context


def opened(context: BrowserContext, service: Site, path: str) -> Page:
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.goto(service.service.ready["url"] + path)
    page.locator("html[data-ready]").wait_for()
    return page


def log_in(page: Page, name: str, password: str = PASSWORD) -> None:
    page.get_by_label("User").fill(name)
    page.get_by_label("Password").fill(password)
    page.get_by_role("button", name="Log in").click()


def test_an_engineer_makes_an_operator_who_logs_in_works_and_logs_out(stranger, browser, service):
    service.login_cookie("eva")
    page = opened(stranger, service, "/access")
    expect(page).to_have_url(re.compile(r"/login\?next=/access$"))
    log_in(page, "eva", "not her word")
    expect(page.get_by_role("alert")).to_contain_text("Name or password is wrong")
    log_in(page, "eva")
    expect(page.locator("#who")).to_have_text("eva")
    expect(page).to_have_url(re.compile(r"/access$"))

    form = page.locator("#new-user")
    form.get_by_label("User").fill("otto")
    form.get_by_role("button").click()
    expect(page.locator("#made")).to_contain_text("/welcome?token=")
    link = re.search(r"(/welcome\?token=\S+)", page.locator("#made").inner_text())[1]
    keys = page.locator("#new-key")
    keys.get_by_label("Name").fill("mes")
    keys.get_by_role("button").click()
    expect(page.locator("#made")).to_contain_text("rcal_")
    key = page.locator("#made").inner_text().rsplit(" ", 1)[1]
    assert service.get("/me", headers={"Authorization": f"Bearer {key}"}).json()["name"] == "mes"
    page.reload()
    expect(page.locator("#trail")).to_contain_text("person eva")
    titles = page.get_by_role("heading").all_inner_texts()
    assert {"Access", "Users", "Keys of programs", "Who did what"} <= set(titles)
    expect(page.locator("body")).not_to_contain_text(key)
    if os.environ.get("ROBOCAL_SCREENSHOTS") == "1":
        page.screenshot(path=SCREENSHOT, animations="disabled")

    with browser.new_context() as own:
        _operate(opened(own, service, link), service)


def _operate(page: Page, service: Site) -> None:
    """The operator chooses a password, may work, may not decide, and leaves."""
    page.get_by_label("New password").fill(PASSWORD)
    page.get_by_role("button", name="Save").click()
    expect(page.locator("#who")).to_have_text("otto")
    expect(page.get_by_role("link", name="Access")).to_have_count(0)
    form = page.locator("#new-cell")
    form.get_by_label("Name", exact=True).fill("mine")
    form.get_by_label("Robot", exact=True).select_option("ur10e")
    for device in ("Robot", "Tracker"):
        form.get_by_label(f"{device} driver").select_option("mock")
        form.get_by_label(f"{device} address").fill("127.0.0.1:9")
    form.get_by_role("button", name="Create cell").click()
    expect(form.get_by_role("alert")).to_contain_text("An engineer can do it")
    page.get_by_role("button", name="Log out").click()
    expect(page).to_have_url(re.compile("/login$"))


def test_a_login_that_ends_leads_to_the_login_and_typed_values_stay(stranger, service):
    stranger.add_cookies([service.login_cookie("mia", "operate")])
    page = opened(stranger, service, "/")
    page.locator("#new-campaign").get_by_label("Poses").fill("33")
    assert service.post("/users/mia/disable").status_code == 200
    expect(page).to_have_url(re.compile(r"/login\?next=%2F$"))
    token = service.post("/users/mia/link").json()["path"].partition("token=")[2]
    assert service.post("/welcome", {"token": token, "password": PASSWORD}).is_success
    log_in(page, "mia")
    expect(page.locator("#new-campaign").get_by_label("Poses")).to_have_value("33")


@pytest.fixture
def waiting(service) -> int:
    """A campaign that no worker takes."""
    device = {"driver": "mock", "address": "127.0.0.1:9"}
    if not service.get("/cells/waits").is_success:
        robot = {"model": "ur10e", **device}
        service.post("/cells", {"name": "waits", "robot": robot, "tracker": device})
    service.post("/cells/waits/arm")
    return service.start_campaign(40, "waits")


def test_a_button_leads_to_the_login_where_the_login_has_ended(stranger, service, waiting):
    stranger.add_cookies([service.login_cookie("nia", "operate")])
    page = opened(stranger, service, f"/campaigns/{waiting}")
    pause = page.get_by_role("button", name="Pause")
    expect(pause).to_be_enabled()
    assert service.post("/users/nia/disable").status_code == 200
    pause.click()
    expect(page).to_have_url(re.compile(rf"/login\?next=%2Fcampaigns%2F{waiting}$"))


def test_a_followed_campaign_leads_to_the_login_where_the_login_has_ended(
    stranger, service, waiting
):
    stranger.add_cookies([service.login_cookie("pia", "operate")])
    asked = []

    def ended_meanwhile(route: Route) -> None:
        if not asked:
            assert service.post("/users/pia/disable").status_code == 200
        asked.append(route.request.url)
        route.continue_()

    stranger.route("**/events*", ended_meanwhile)
    page = opened(stranger, service, f"/campaigns/{waiting}")
    expect(page).to_have_url(re.compile(rf"/login\?next=%2Fcampaigns%2F{waiting}$"))


def test_passwords_stay_out_of_the_browsers_storage(stranger, service):
    page = opened(stranger, service, "/login")
    page.get_by_label("User").fill("eva")
    page.get_by_label("Password").fill(PASSWORD)
    kept = page.evaluate("JSON.stringify({...sessionStorage, ...localStorage})")
    assert "eva" in kept
    assert PASSWORD not in kept

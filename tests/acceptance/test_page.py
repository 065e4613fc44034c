"""The page in a real browser: from the form to the result, on an emulated cell."""

import os
import re
import shutil
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from tests.integration.service_cell import ROOT, Site, World, emulated_world, installation
from tests.measured_cell import true_cell, write_bundle

PICTURES = ROOT / "docs" / "images"
FIRST_CONTROL_MS = 3000
"""How soon a person can use the page."""
PATIENCE_MS = 300_000
"""Planning, motion and identification on a busy machine."""
expect.set_options(timeout=PATIENCE_MS)


@pytest.fixture(scope="module")
def world(tmp_path_factory) -> Iterator[World]:
    with emulated_world(tmp_path_factory.mktemp("world"), time_scale=60) as running:
        yield running


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Iterator[Site]:
    with installation(tmp_path_factory.mktemp("site"), port=_free_port()) as running:
        yield running


def _free_port() -> int:
    """A port that the service keeps when it is started again."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        return listening.getsockname()[1]


class Watched:
    """A page, what its console said and whom it asked."""

    def __init__(self, page: Page, site: Site) -> None:
        self.page = page
        self.root = site.service.ready["url"]
        self.errors: list[str] = []
        self.requests: list[str] = []
        page.set_default_timeout(PATIENCE_MS)
        page.on("console", self._heard)
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("request", lambda request: self.requests.append(request.url))

    def _heard(self, message) -> None:
        if message.type in {"error", "warning"}:
            self.errors.append(message.text)

    def open(self, path: str = "/") -> None:
        self.page.goto(self.root + path)
        self.page.locator("html[data-ready]").wait_for()

    def require_clean(self) -> None:
        assert self.errors == []
        hosts = {urlsplit(url).hostname for url in self.requests if not url.startswith("data:")}
        assert hosts == {"127.0.0.1"}

    def describe_cell(self, name: str, address: str) -> Locator:
        form = self.page.locator("#new-cell")
        form.get_by_label("Name", exact=True).fill(name)
        form.get_by_label("Robot", exact=True).select_option("ur10e")
        for device in ("Robot", "Tracker"):
            form.get_by_label(f"{device} driver").select_option("mock")
            form.get_by_label(f"{device} address").fill(address)
        return form

    def create_cell(self, name: str, address: str) -> None:
        form = self.describe_cell(name, address)
        form.get_by_role("button", name="Create cell").click()
        self.page.locator(f"[data-cell={name}]").wait_for()

    def arm(self, name: str) -> None:
        self.page.locator(f"[data-cell={name}]").get_by_role("button", name="Arm").click()
        dialog = self.page.get_by_role("dialog")
        expect(dialog).to_contain_text("emergency stop within reach")
        dialog.get_by_role("button", name="I have looked").click()
        self.page.locator(f"[data-cell={name}] .lamp.armed").wait_for()

    def start_campaign(self, cell: str, kind: str, poses: int) -> int:
        form = self.page.locator("#new-campaign")
        form.get_by_label("Cell").select_option(cell)
        form.get_by_label("Kind").select_option(kind)
        form.get_by_label("Poses").fill(str(poses))
        form.get_by_label("Settling time").fill("0.2")
        form.get_by_role("button", name="Start campaign").click()
        self.page.wait_for_url(re.compile(r"/campaigns/\d+$"))
        return int(self.page.url.rsplit("/", 1)[1])

    def await_state(self, word: str) -> None:
        expect(self.page.locator("#state")).to_have_text(word, timeout=PATIENCE_MS)


@contextmanager
def watched(browser: Browser, site: Site) -> Iterator[Watched]:
    with browser.new_context(viewport={"width": 1280, "height": 1150}) as context:
        context.add_cookies([site.login_cookie()])
        yield Watched(context.new_page(), site)


def plotted(page: Page, selector: str = "[data-plot]") -> list[list[float]]:
    """Heights of the points of every series, as plotly.js holds them."""
    return page.locator(selector).evaluate("place => place.data.map(trace => [...trace.y])")


def test_a_cell_is_made_calibrated_and_verified_in_the_browser(browser, site, world):
    with watched(browser, site) as seen:
        page = seen.page
        seen.open()
        seen.create_cell("journey", world.address)
        page.get_by_role("button", name="Test connection").click()
        expect(page.locator("[data-cell=journey] .notice")).to_contain_text("safety state normal")
        seen.arm("journey")

        number = seen.start_campaign("journey", "calibrate", 24)
        expect(page.locator("#count")).to_have_text(re.compile(r"^(\d|1\d|2[0-3]) of 24 readings$"))
        seen.await_state("Finished")
        page.locator("[data-drawn]").wait_for()
        _require_result(seen, site, number)
        keep_picture(page, "page.png")

        seen.open()
        seen.arm("journey")
        number = seen.start_campaign("journey", "verify", 5)
        seen.await_state("Finished")
        page.locator("[data-drawn]").wait_for()
        verification = site.get(f"/campaigns/{number}/verification").json()
        assert plotted(page) == [verification[side]["errors_mm"] for side in ("before", "after")]
        expect(page.locator(".tile.good")).to_contain_text("% smaller")
        assert site.campaign(number)["total"] == 10
        seen.require_clean()


def _require_result(seen: Watched, site: Site, number: int) -> None:
    page = seen.page
    found = site.get(f"/campaigns/{number}/identification").json()
    rows = page.locator("#parameters tr[data-parameter]")
    assert rows.count() == 30
    _require_series_add_up(found)
    residual_rows = found["residual_rows"]
    before_mm, *after_mm = plotted(page)
    assert before_mm == residual_rows["before_mm"]
    assert sorted(chain(*after_mm)) == sorted(residual_rows["after_mm"])
    tiles = page.locator(".tile-value").all_inner_texts()
    before, after = (float(text.removesuffix("mm")) for text in tiles[:2])
    assert before == pytest.approx(found["residuals"]["before"]["position_rms_mm"], abs=5e-4)
    assert after == pytest.approx(found["residuals"]["held_out"]["position_rms_mm"], abs=5e-4)
    assert after < 0.2 * before
    buttons = page.locator(".modebar-btn").evaluate_all("all => all.map(b => b.dataset.title)")
    assert buttons
    assert not [title for title in buttons if re.search("cloud|share|chart studio", title, re.I)]
    first_view = page.locator("#readings-plot .scatterlayer").first
    expect(first_view.locator(".trace").first.locator(".point")).to_have_count(24)


def _require_series_add_up(found: dict) -> None:
    """The rows give the same figures as their summary, which robocal makes on its own."""
    rows, residuals = found["residual_rows"], found["residuals"]
    held_out = np.array(rows["held_out"])
    fitted = ~held_out & ~np.array(rows["rejected"])
    for series, chosen, summary in (
        ("before_mm", held_out, "before"),
        ("after_mm", held_out, "held_out"),
        ("after_mm", fitted, "fit"),
    ):
        values = np.array(rows[series])[chosen]
        assert len(values) == residuals[summary]["rows"]
        rms = np.sqrt(np.mean(values**2))
        # The rows are rounded to a nanometre.
        assert rms == pytest.approx(residuals[summary]["position_rms_mm"], abs=2e-6)


def keep_picture(page: Page, name: str) -> None:
    """Take the picture that README shows, where the run was asked for pictures."""
    if os.environ.get("ROBOCAL_SCREENSHOTS") != "1":
        return
    # What was pressed or focused before may have scrolled the page.
    page.evaluate("scrollTo(0, 0)")
    page.screenshot(path=PICTURES / name, animations="disabled")


def test_the_first_control_can_be_used_within_three_seconds(browser, site):
    with watched(browser, site) as seen:
        for _ in range(3):
            seen.open()
            took_ms = seen.page.evaluate("performance.now()")
            if took_ms < FIRST_CONTROL_MS:
                break
        # Three tries, for this machine may be busy with something else.
        assert took_ms < FIRST_CONTROL_MS
        expect(seen.page.get_by_role("button", name="Start campaign")).to_be_enabled()
        seen.require_clean()


def test_a_refusal_stands_beside_the_form_and_nothing_typed_is_lost(browser, site):
    with watched(browser, site) as seen:
        seen.open()
        seen.create_cell("refused", "127.0.0.1:9")
        form = seen.page.locator("#new-campaign")
        form.get_by_label("Kind").select_option("calibrate")
        form.get_by_label("Poses").fill("33")
        form.get_by_role("button", name="Start campaign").click()
        expect(form.get_by_role("alert")).to_contain_text("Cell 'refused' is not armed")
        expect(form.get_by_label("Poses")).to_have_value("33")
        seen.page.reload()
        expect(form.get_by_label("Poses")).to_have_value("33")
        expect(form.get_by_label("Cell")).to_have_value("refused")


def test_a_cell_without_a_floor_is_made_by_leaving_the_field_empty(browser, site):
    with watched(browser, site) as seen:
        seen.open()
        form = seen.describe_cell("hanging", "127.0.0.1:9")
        form.locator("summary").click()
        floor = form.get_by_label("Floor height")
        expect(floor).to_have_value("0")
        floor.fill("")
        form.get_by_role("button", name="Create cell").click()
        seen.page.locator("[data-cell=hanging]").wait_for()
        limits = site.get("/cells/hanging").json()["limits"]
        assert (limits["floor_mm"], limits["speed_deg_s"]) == (None, 30.0)
        seen.require_clean()


def test_typed_values_survive_a_restart_of_the_service(browser, site):
    with watched(browser, site) as seen:
        seen.open()
        form = seen.describe_cell("later", "127.0.0.1:9")
        site.service.kill()
        form.get_by_role("button", name="Create cell").click()
        expect(form.get_by_role("alert")).to_contain_text("What you typed is kept")
        site.start_service()
        expect(form.get_by_label("Name", exact=True)).to_have_value("later")
        form.get_by_role("button", name="Create cell").click()
        seen.page.locator("[data-cell=later]").wait_for()


def test_a_campaign_is_steered_by_keyboard_alone(browser, site, world, tmp_path):
    with emulated_world(tmp_path, time_scale=5) as slow, watched(browser, site) as seen:
        page = seen.page
        site.make_cell(slow, "keys")
        number = site.start_campaign(12, "keys")
        seen.open(f"/campaigns/{number}")
        expect(page.locator("#count")).to_have_text(re.compile(r"^[1-9]"))
        _press(page, "Pause")
        seen.await_state("Paused")
        expect(page.locator("#reason")).to_contain_text("paused by a person")
        _press(page, "Resume")
        expect(page.locator("#state")).not_to_have_text("Paused")
        _press(page, "Abort")
        expect(page.get_by_role("dialog")).to_contain_text("The robot stops")
        _press(page, "Abort the campaign")
        seen.await_state("Aborted")
        expect(page.locator("#result")).to_contain_text("ended without a result")
        expect(page.locator("#controls")).to_be_hidden()
        seen.require_clean()


def test_a_page_follows_its_campaign_again_after_a_restart_and_a_refusal(browser, site, tmp_path):
    with emulated_world(tmp_path, time_scale=5) as slow, watched(browser, site) as seen:
        page = seen.page
        site.make_cell(slow, "restarted")
        number = site.start_campaign(12, "restarted")
        seen.open(f"/campaigns/{number}")
        expect(page.locator("#count")).to_have_text(re.compile(r"^[2-9]"))
        page.route("**/events*", lambda route: route.fulfill(status=503), times=1)
        site.service.kill()
        expect(page.locator("#connection")).to_be_visible()
        site.start_service()
        seen.await_state("Finished")
        expect(page.locator("#connection")).to_be_hidden()
        page.locator("[data-drawn]").wait_for()
        # Each reading once: none is lost with the connection, none told twice.
        poses = page.locator("#readings-plot").evaluate("plot => plot.data[0].text")
        assert poses == [f"Pose {pose}, repeat 0" for pose in range(12)]


def _press(page: Page, name: str) -> None:
    """Walk to a button by Tab, as a person without a mouse would, and press Enter."""
    button = page.get_by_role("button", name=name, exact=True)
    expect(button).to_be_enabled()
    for _ in range(30):
        if button.evaluate("element => element === document.activeElement"):
            page.keyboard.press("Enter")
            return
        page.keyboard.press("Tab")
    raise AssertionError(f"Tab does not reach the button {name}")


def test_a_bundle_is_imported_and_its_result_shown(browser, site, tmp_path):
    write_bundle(tmp_path / "bundle", "staubli_tx60", true_cell("staubli_tx60", 5), full_pose=False)
    bundle = shutil.make_archive(str(tmp_path / "bundle"), "zip", tmp_path / "bundle")
    broken = tmp_path / "broken.zip"
    broken.write_bytes(Path(bundle).read_bytes()[:-200])
    with watched(browser, site) as seen:
        seen.open()
        form = seen.page.locator("#import-bundle")
        form.get_by_label("Bundle").set_input_files(broken)
        form.get_by_role("button", name="Import").click()
        expect(form.get_by_role("alert")).to_contain_text(re.compile("zip", re.IGNORECASE))
        seen.errors.clear()

        form.get_by_label("Bundle").set_input_files(bundle)
        form.get_by_role("button", name="Import").click()
        seen.page.wait_for_url(re.compile(r"/campaigns/\d+$"))
        seen.await_state("Finished")
        seen.page.locator("[data-drawn]").wait_for()
        expect(seen.page.locator("#parameters tr.undetermined").first).to_be_visible()
        expect(seen.page.locator("#readings")).to_be_hidden()
        seen.require_clean()

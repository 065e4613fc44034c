"""What an operator's hand meets on the first page: pointer, keyboard, and a refresh in between."""

import json
from collections.abc import Iterator

import pytest
from playwright.sync_api import Locator, expect

from tests.acceptance.test_page import Watched, watched
from tests.integration.service_cell import Site, installation

NOWHERE = "127.0.0.1:9"
TABLET = {"width": 820, "height": 1180}


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Iterator[Site]:
    with installation(tmp_path_factory.mktemp("operator"), workers=0) as running:
        yield running


def make_cell(place: Site, name: str, address: str, **more: object) -> None:
    device = {"driver": "mock", "address": address}
    body = {"name": name, "robot": {"model": "ur10e", **device}, "tracker": device, **more}
    assert place.post("/cells", body).status_code == 201


def press_and_release(seen: Watched, button: Locator) -> None:
    """As a hand does: the page may move what is under the pointer in between."""
    button.scroll_into_view_if_needed()
    box = button.bounding_box()
    seen.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] - 2)
    seen.page.mouse.down()
    seen.page.evaluate("new Promise(done => requestAnimationFrame(() => setTimeout(done)))")
    seen.page.mouse.up()


def test_the_first_click_on_start_counts_though_it_leaves_a_field(browser, place):
    make_cell(place, "clicked", NOWHERE)
    with watched(browser, place) as seen:
        page = seen.page
        page.set_viewport_size(TABLET)
        seen.open()
        form = page.locator("#new-campaign")
        form.get_by_label("Cell").select_option("clicked")
        form.get_by_label("Kind").select_option("calibrate")
        # Typed, for a browser tells of a change only when such a field is left.
        form.get_by_label("Poses").press("Control+a")
        page.keyboard.type("24")
        note = page.locator("#campaign-poses-note")
        expect(note).to_have_text("Enough for the ur10e.")
        page.locator("#plan[data-poses='24']").wait_for()
        with page.expect_request(lambda request: request.method == "POST") as posted:
            press_and_release(seen, form.get_by_role("button", name="Start campaign"))
        assert json.loads(posted.value.post_data)["poses"] == 24
        expect(form.get_by_role("alert")).to_contain_text("is not armed")
        expect(note).to_have_text("Enough for the ur10e.")


def test_a_note_that_comes_or_goes_moves_nothing_below_it(browser, place):
    make_cell(place, "quiet", NOWHERE)
    with watched(browser, place) as seen:
        page = seen.page
        page.set_viewport_size(TABLET)
        seen.open()
        form = page.locator("#new-campaign")
        height = form.evaluate("form => form.offsetHeight")
        form.get_by_label("Kind").select_option("calibrate")
        form.get_by_label("Cell").select_option("quiet")
        expect(page.locator("#campaign-cell-note")).to_contain_text("is disarmed")
        form.get_by_label("Poses").fill("3")
        expect(page.locator("#campaign-poses-note")).to_contain_text("Too few")
        assert form.evaluate("form => form.offsetHeight") == height
        # What the browser itself says of the field goes with its fault.
        form.get_by_label("Poses").fill("")
        expect(page.locator("#campaign-poses-note.bad")).not_to_have_text("")
        form.get_by_label("Poses").fill("24")
        expect(page.locator("#campaign-poses-note.good")).to_contain_text("Enough")
        assert form.evaluate("form => form.offsetHeight") == height

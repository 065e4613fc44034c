"""What the page of a campaign follows, in a real browser: the campaign is written by the tests."""

from collections.abc import Iterator

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from service.campaigns import follow_ups, life
from service.clock import utc_now
from service.db.models import CampaignRow, PoseRow, ReadingRow, WhereaboutsRow
from service.procedures.plan import PURPOSE_HEALTH
from tests.acceptance.test_page import watched
from tests.acceptance.test_page_views import ended_campaigns, kept, result
from tests.integration.service_cell import START_DEG, Site, installation

START = [float(q) for q in np.radians(START_DEG)]
UPRIGHT = [0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0]
HEALTHY = {"alarm": False, "trend_alarm": False, "advice": "", "position_rms_mm": 0.04}
HEALTHY |= {"chi_square": 20.0, "chi_square_limit": 40.0}


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Iterator[Site]:
    with installation(tmp_path_factory.mktemp("live")) as running:
        yield running


def running_campaign(place: Site, cell: str, kind: str) -> int:
    """A campaign that seems to run, though no worker drives it."""
    (number,) = ended_campaigns(place, cell, 1)
    with kept(place) as session:
        row = session.get_one(CampaignRow, number)
        row.state, row.kind, row.pose_count, row.reason = "running", kind, 2, ""
    return number


def plan(place: Site, number: int, poses: range, purpose: str) -> None:
    with kept(place) as session:
        for idx in poses:
            pose = PoseRow(campaign=number, idx=idx, commanded=START, purpose=purpose)
            session.add(pose)


def read_pose(place: Site, number: int, idx: int) -> None:
    """Accept a reading, as a worker does."""
    seconds = dict.fromkeys(("motion_s", "settling_s", "measuring_s", "overhead_s"), 1.0)
    times = dict.fromkeys(("robot_time_s", "tracker_time_s", "t_s"), float(idx))
    with kept(place) as session:
        revision = life.advance(session.get_one(CampaignRow, number))
        reading = ReadingRow(campaign=number, idx=idx, repeat=0, revision=revision, attempt=1)
        reading.fence, reading.shots, reading.speed, reading.settle_s = 1, 1, 0.5, 0.2
        reading.joints, reading.commanded, reading.approach = START, START, [1] * len(START)
        reading.position, reading.spread, reading.created = [1.0, 2.0, 0.5], 0.0, utc_now()
        for name, value in (seconds | times).items():
            setattr(reading, name, value)
        session.add(reading)


def stand(place: Site, number: int, joints: list[float]) -> None:
    with kept(place) as session:
        session.merge(WhereaboutsRow(campaign=number, joints=joints))


def test_a_health_checks_readings_are_drawn_and_its_result_takes_the_live_views_place(
    browser, place
):
    number = running_campaign(place, "healthy", "health")
    plan(place, number, range(2), PURPOSE_HEALTH)
    with watched(browser, place) as seen:
        page = seen.page
        seen.open(f"/campaigns/{number}")
        for idx in range(2):
            read_pose(place, number, idx)
        points = page.locator("#readings-plot .scatterlayer").first.locator(".trace").first
        expect(points.locator(".point")).to_have_count(2)
        expect(page.locator("#readings-plot .legend")).to_contain_text("Health check pose")
        expect(page.locator("#live")).to_be_visible()
        with kept(place) as session:
            session.add(result(number, "health", HEALTHY, utc_now()))
            row = session.get_one(CampaignRow, number)
            row.state = "finished"
            life.advance(row)
        expect(page.locator("#health-verdict")).to_contain_text("as it was calibrated")
        expect(page.locator("#live")).to_be_hidden()
        with page.expect_download() as download:
            page.get_by_role("link", name="health.json").click()
        assert "chi_square_limit" in download.value.path().read_text()
        expect(page.locator("#result-downloads a")).to_have_count(1)
        seen.require_clean()


def test_a_second_round_of_a_follow_up_joins_the_picture(browser, place):
    number = running_campaign(place, "rounds", "follow_up")
    plan(place, number, range(2), follow_ups.PURPOSE)
    with watched(browser, place) as seen:
        page = seen.page
        seen.open(f"/campaigns/{number}")
        read_pose(place, number, 0)
        page.locator("#live[data-pose='0']").wait_for()
        assert page.locator("#live").get_attribute("data-tips") == "2"
        plan(place, number, range(2, 4), follow_ups.PURPOSE)
        read_pose(place, number, 2)
        page.locator("#live[data-tips='4']").wait_for()
        expect(page.locator("#readings-plot .legend")).to_contain_text("Follow-up pose")
        seen.require_clean()


def test_the_arm_stays_in_the_picture_wherever_it_goes(browser, place):
    number = running_campaign(place, "elbow", "calibrate")
    plan(place, number, range(1), "calibrate")
    stand(place, number, START)
    with watched(browser, place) as seen:
        page = seen.page
        # The arm is drawn at once where it is, without the way there.
        page.emulate_media(reduced_motion="reduce")
        seen.open(f"/campaigns/{number}")
        page.locator("#live[data-arms='1']").wait_for()
        drawn = page.locator("#live-space canvas")
        drawn.focus()
        page.keyboard.press("ArrowLeft")
        for arms, joints in ((2, UPRIGHT), (3, [1.0, 0.0, *UPRIGHT[2:]]), (4, START)):
            stand(place, number, joints)
            page.locator(f"#live[data-arms='{arms}']").wait_for()
            assert arm_at_the_border(page) == 0
        # It is the test that looks at the pixels again and again.
        seen.errors = [error for error in seen.errors if "willReadFrequently" not in error]
        seen.require_clean()


def arm_at_the_border(page: Page) -> int:
    """Count the pixels of the arm's two colours along the edge of the picture."""
    return page.evaluate("""async () => {
        const painted = () => new Promise(requestAnimationFrame);
        await painted().then(painted);
        const script = document.querySelector("script[src*='campaign']").src;
        const { colour } = await import(script.replace("campaign.js", "colours.js"));
        const paints = ["arm", "arm-edge"].map(name => colour(name).match(/\\d+/g).join());
        const canvas = document.querySelector("#live-space canvas");
        const ink = canvas.getContext("2d");
        const { width, height } = canvas;
        const { data } = ink.getImageData(0, 0, width, height);
        const isArm = (x, y) => {
            const i = 4 * (y * width + x);
            return paints.includes([data[i], data[i + 1], data[i + 2]].join());
        };
        let found = 0;
        for (let x = 0; x < width; x++) found += isArm(x, 0) + isArm(x, height - 1);
        for (let y = 0; y < height; y++) found += isArm(0, y) + isArm(width - 1, y);
        return found;
    }""")

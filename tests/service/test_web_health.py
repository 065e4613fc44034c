"""What the page says of a health check, in the language of the page."""

import re

import pytest

from service.clock import utc_now
from service.db.models import CampaignRow, ResultRow
from service.web.words import LANGUAGES

FIGURES = {"position_rms_mm": 0.04, "chi_square": 20.0, "chi_square_limit": 40.0}
MOVED = "The base or the tracker moved."


@pytest.fixture
def verdict(site, client, cell, database):
    """Store a check and read the sentence of its page."""

    def told(language: str, advice: str, *, alarm: bool, trend_alarm: bool = False) -> str:
        client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": 40})
        found = FIGURES | {"alarm": alarm, "trend_alarm": trend_alarm, "advice": advice}
        origin = {"bundle_sha256": "ab" * 32, "software_version": "0", "settings": {}}
        with database.write() as session:
            campaign = session.get_one(CampaignRow, 1)
            campaign.state, campaign.kind = "finished", "health"
            row = ResultRow(campaign=1, kind="health", document=found, created=utc_now(), **origin)
            session.add(row)
        header = {"Accept-Language": language}
        page = site.get("/parts/campaigns/1/result", headers=header).text
        return re.search(r'id="health-verdict">(.*?)</p>', page, re.DOTALL)[1].strip()

    return told


@pytest.mark.parametrize("trend_alarm", [False, True])
def test_a_check_without_an_alarm_is_told_in_one_language(verdict, trend_alarm):
    told = verdict("zh", "Nothing to do.", alarm=False, trend_alarm=trend_alarm)
    assert told == LANGUAGES["zh"]["health_drifts" if trend_alarm else "health_good"]
    assert not re.search("[A-Za-z]", told)


def test_nothing_is_to_be_done_where_nothing_moved(verdict):
    assert "Nothing to do." in verdict("en", "Nothing to do.", alarm=False)


def test_the_advice_of_an_alarm_stands_apart_in_its_own_language(verdict):
    told = verdict("zh", MOVED, alarm=True)
    assert told.startswith(LANGUAGES["zh"]["health_alarm"])
    assert told.endswith(f'<span lang="en">{MOVED}</span>')

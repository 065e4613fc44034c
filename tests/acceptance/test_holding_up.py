"""A small share of the studies whose whole figures stand in docs/running.md."""

from tests.studies import many_cells, power_cuts


def test_after_power_cuts_a_campaign_goes_on_by_itself_and_nothing_is_lost(tmp_path):
    outcome = power_cuts.run(2, tmp_path)
    assert (outcome.lost, outcome.doubled, outcome.changed, outcome.wrong_pose) == (0, 0, 0, 0)
    assert outcome.integrity == "ok"
    assert outcome.driven_again <= 2
    for cut in outcome.cuts:
        assert f"campaign 1 (cell 'c1') is running with {cut.readings} readings stored" in cut.said


def test_campaigns_on_several_cells_with_workers_dying_lose_and_double_nothing(postgresql_url):
    outcome = many_cells.run(5, cells=2, workers=2, kill_every=6, url=postgresql_url)
    assert outcome.killed > 0
    assert (outcome.missing, outcome.doubled, outcome.wrong_pose) == (0, 0, 0)
    assert (outcome.mixed, outcome.unfinished) == (0, 0)

"""A person's abort is seen without the database, and outlives whatever else stops the job."""

from threading import Event

import pytest

from service.campaigns import life
from service.campaigns.stop_flag import StopFlag, lower_all
from service.db.models import CampaignRow
from service.jobs.watch import Cause, Watch


@pytest.fixture
def watch(job):
    flag = StopFlag(job.database, job.campaign)
    return Watch(job.queue, job.claim, lambda: None, Event(), 60.0, flag.is_up)


def set_campaign(job, **values):
    with job.database.write() as session:
        row = session.get_one(CampaignRow, job.campaign)
        for name, value in values.items():
            setattr(row, name, value)


def test_a_raised_flag_stops_the_job_for_good(job, watch):
    with StopFlag(job.database, job.campaign).up() as is_told:
        assert is_told
        assert watch.cause() is Cause.abort
    assert watch.cause() is Cause.abort


def test_a_flag_that_is_lowered_again_stops_nothing(job, watch):
    with StopFlag(job.database, job.campaign).up():
        pass
    assert watch.cause() is None


def test_a_campaign_that_does_not_run_gets_no_flag(job, watch):
    set_campaign(job, state="finished")
    with StopFlag(job.database, job.campaign).up() as is_told:
        assert not is_told
        assert watch.cause() is None


def test_a_flag_of_a_killed_service_is_lowered_at_the_next_start(job, watch):
    with StopFlag(job.database, job.campaign).up():
        lower_all(job.database)
        assert watch.cause() is None


@pytest.mark.parametrize("cause", [Cause.pause, Cause.disarmed, Cause.shutdown, None])
def test_a_stored_abort_wins_over_whatever_else_stops_the_job(job, cause):
    set_campaign(job, wish=Cause.abort)
    side = life.WorkersSide(job.queue, job.claim)
    with job.database.write() as session:
        if cause is None:
            side.hold(session, "the tracker is silent")
        else:
            side.stop(session, cause)
    with job.database.read() as session:
        assert session.get_one(CampaignRow, job.campaign).state == "aborted"

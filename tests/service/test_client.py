"""The Python client against a running service."""

import subprocess
import sys

import numpy as np
import pytest

from robocal.frames import quaternion_from_rotation
from service.campaigns.models import CampaignKind, CampaignState, NewCampaign
from service.client import Client, Refused, is_genuine
from service.compensation.models import WantedPose
from service.parameters import store
from service.webhooks.models import WebhookEvent
from service.webhooks.signature import sign
from tests.credentials import KEY
from tests.robocal.formats.calibrated_arms import calibrated_arm
from tests.service.released_arm import content_of


@pytest.fixture
def mes(client):
    with Client(str(client.base_url).partition("/api")[0], KEY) as opened:
        yield opened


def test_the_way_of_an_mes(mes, cell, database):
    wanted = NewCampaign(cell="c1", kind=CampaignKind.calibrate, poses=8)
    number = mes.start(wanted).id
    assert mes.campaign(number).state is CampaignState.queued
    arm = calibrated_arm("ur10e")
    with database.write() as session:
        store.add_candidate(session, "c1", number, content_of(arm))
    with pytest.raises(Refused, match="not verified") as refused:
        mes.release("c1", 1)
    assert refused.value.status == 409
    assert mes.release("c1", 1, "commissioning").version == 1
    released = mes.parameters("c1")
    assert mes.parameters("c1") is released
    target = arm.true.poses(np.deg2rad([[20, -80, 95, -100, -85, 10]]))
    pose = WantedPose(
        xyz_mm=tuple(target[0, :3, 3] * 1e3),
        quaternion=tuple(quaternion_from_rotation(target[:, :3, :3])[0]),
    )
    joints = mes.compensate("c1", [pose]).joints_deg
    assert np.abs(arm.true.poses(np.deg2rad(joints)) - target).max() < 1e-6
    assert [step.event for step in mes.history("c1").history] == ["released", "computed"]
    assert mes.health("c1").checks == []
    with pytest.raises(Refused, match="has no identification"):
        mes.certificate(number)
    hook = mes.subscribe("https://mes.plant.example/x", [WebhookEvent.drift_alarm])
    assert hook.secret


def test_campaigns_are_read_over_all_pages(mes, cell, client):
    wanted = NewCampaign(cell="c1", kind=CampaignKind.calibrate, poses=8)
    numbers = [mes.start(wanted).id for _ in range(53)]
    assert [campaign.id for campaign in mes.campaigns()] == numbers[::-1]
    assert list(mes.campaigns(CampaignState.finished)) == []


def test_a_campaign_is_watched_until_it_has_ended(mes, cell, client):
    number = mes.start(NewCampaign(cell="c1", kind=CampaignKind.calibrate, poses=8)).id
    seen = []
    for campaign in mes.watch(number):
        seen.append(campaign.state)
        if len(seen) == 1:
            assert client.post(f"campaigns/{number}/abort").is_success
    assert seen[0] is CampaignState.queued
    assert seen[-1] is CampaignState.aborted
    assert [campaign.state for campaign in mes.watch(number)] == [CampaignState.aborted]
    with pytest.raises(Refused, match="99"):
        next(mes.watch(99))


def test_the_client_loads_neither_service_nor_numerics():
    heavy = ("numpy", "fastapi", "starlette", "sqlalchemy", "alembic", "uvicorn", "drivers")
    program = f"import sys, service.client; print(set({heavy}) & set(sys.modules))"
    found = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert found.stdout == "set()\n"


def test_a_delivery_is_believed_only_with_its_signature_and_while_fresh():
    body, now = b'{"event":"drift.alarm"}', 1_790_000_000.0
    signature = sign("secret", "1790000000", body)
    assert is_genuine("secret", "1790000000", signature, body, now)
    assert not is_genuine("secret", "1790000000", signature, body + b" ", now)
    assert not is_genuine("other", "1790000000", signature, body, now)
    assert not is_genuine("secret", "1790000000", signature, body, now + 301)
    assert not is_genuine("secret", "1790000001", signature, body, now)

"""Webhooks against a real receiver: signed, tried again, refused where they must not go."""

import hashlib
import hmac
import json
import threading
import time

import pytest

from service.settings import Settings
from service.webhooks.destination import Forbidden, destination
from service.webhooks.sender import Sender
from tests.service.webhook_receiver import dripping_receiver, receiver

LOCAL = ("127.0.0.0/8",)
CAMPAIGN = {"cell": "c1", "kind": "calibrate", "poses": 8}


def sender(database, settings: Settings, **change) -> Sender:
    quick = {"webhook_networks": LOCAL, "webhook_retry_s": 0.05, "webhook_timeout_s": 5}
    return Sender(database, settings.model_copy(update=quick | change), threading.Event())


def subscribe(client, url: str, *events: str, **more) -> dict:
    answer = client.post("webhooks", json={"url": url, "events": list(events), **more})
    assert answer.status_code == 201, answer.text
    return answer.json()


def log(client, number: int) -> list[dict]:
    return client.get(f"webhooks/{number}/deliveries").json()["deliveries"]


def send_until(sending: Sender, condition, within_s: float = 10.0) -> None:
    deadline = time.monotonic() + within_s
    while not condition():
        assert time.monotonic() < deadline
        if not sending.send_next():
            threading.Event().wait(0.01)


def test_an_aborted_campaign_is_announced_with_a_signature_that_proves_it(
    client, cell, database, settings
):
    with receiver(204) as heard:
        hook = subscribe(client, heard.url, "campaign.finished")
        client.post("campaigns", json=CAMPAIGN)
        client.post("campaigns/1/abort")
        assert sender(database, settings).send_next()
    ((headers, body),) = heard.requests
    message = headers["Robocal-Timestamp"].encode() + b"." + body
    expected = hmac.new(hook["secret"].encode(), message, hashlib.sha256).hexdigest()
    assert headers["Robocal-Signature"] == f"sha256={expected}"
    assert abs(time.time() - int(headers["Robocal-Timestamp"])) < 60
    content = json.loads(body)
    assert (content["event"], content["cell"]) == ("campaign.finished", "c1")
    assert (content["campaign"]["id"], content["campaign"]["state"]) == (1, "aborted")
    (entry,) = log(client, hook["id"])
    assert (entry["state"], entry["attempts"], entry["outcome"]) == (
        "delivered",
        1,
        "Answered 204.",
    )


def test_a_receiver_that_fails_first_is_asked_again_with_the_same_delivery(
    client, cell, database, settings
):
    with receiver(503, 500, 200) as heard:
        hook = subscribe(client, heard.url, "parameters.released")
        client.post(f"webhooks/{hook['id']}/test")
        sending = sender(database, settings)
        send_until(sending, lambda: log(client, hook["id"])[0]["state"] == "delivered")
    assert len(heard.requests) == 3
    assert len({headers["Robocal-Delivery"] for headers, _ in heard.requests}) == 1
    assert len({body for _, body in heard.requests}) == 1
    assert log(client, hook["id"])[0]["attempts"] == 3


def test_each_wait_is_twice_the_one_before(client, cell, database, settings):
    with receiver(500) as heard:
        hook = subscribe(client, heard.url, "drift.alarm")
        client.post(f"webhooks/{hook['id']}/test")
        sending = sender(database, settings, webhook_retry_s=100.0)
        waits = []
        for _ in range(4):
            with database.write() as session:
                session.connection().exec_driver_sql("UPDATE webhook_delivery SET due = 0")
            assert sending.send_next()
            with database.read() as session:
                due = session.connection().exec_driver_sql("SELECT due FROM webhook_delivery")
                waits.append(due.scalar_one() - time.time())
    assert waits == pytest.approx([100, 200, 400, 800], abs=5)


def test_what_waits_for_a_clock_that_was_set_back_is_sent_at_once(client, cell, database, settings):
    with receiver(200) as heard:
        hook = subscribe(client, heard.url, "drift.alarm")
        client.post(f"webhooks/{hook['id']}/test")
        with database.write() as session:
            session.connection().exec_driver_sql("UPDATE webhook_delivery SET due = due + 86400")
        assert sender(database, settings).send_next()
        assert not sender(database, settings).send_next()
    assert len(heard.requests) == 1


def test_after_the_last_attempt_a_delivery_is_given_up(client, cell, database, settings):
    with receiver(500) as heard:
        hook = subscribe(client, heard.url, "drift.alarm")
        client.post(f"webhooks/{hook['id']}/test")
        sending = sender(database, settings, webhook_attempts=2)
        send_until(sending, lambda: log(client, hook["id"])[0]["state"] == "failed")
    assert len(heard.requests) == 2
    assert not sending.send_next()


def test_a_receiver_that_is_not_there_yet_gets_it_later(client, cell, database, settings):
    with receiver() as gone:
        pass
    hook = subscribe(client, gone.url, "drift.alarm")
    client.post(f"webhooks/{hook['id']}/test")
    assert sender(database, settings).send_next()
    (entry,) = log(client, hook["id"])
    assert (entry["state"], entry["outcome"]) == ("pending", "No answer (ConnectError).")


def test_a_receiver_that_drips_its_answer_has_one_time_for_all_of_it(
    client, cell, database, settings
):
    with dripping_receiver() as dripping:
        hook = subscribe(client, dripping.url, "drift.alarm")
        client.post(f"webhooks/{hook['id']}/test")
        assert sender(database, settings, webhook_timeout_s=0.5).send_next()
        assert dripping.left.wait(10.0)
    (entry,) = log(client, hook["id"])
    assert (entry["state"], entry["outcome"]) == ("pending", "No answer within 0.5 s.")


def test_redirects_are_not_followed(client, cell, database, settings):
    with receiver(307) as heard:
        hook = subscribe(client, heard.url, "drift.alarm")
        client.post(f"webhooks/{hook['id']}/test")
        sender(database, settings).send_next()
    assert len(heard.requests) == 1
    assert "redirects are not followed" in log(client, hook["id"])[0]["outcome"]


def test_a_private_address_is_refused_unless_its_network_is_named(client, cell, database, settings):
    with receiver(204) as heard:
        hook = subscribe(client, heard.url, "drift.alarm")
        client.post(f"webhooks/{hook['id']}/test")
        sender(database, settings, webhook_networks=()).send_next()
    assert heard.requests == []
    assert "ROBOCAL_WEBHOOK_NETWORKS" in log(client, hook["id"])[0]["outcome"]


@pytest.mark.parametrize(
    "host",
    [
        "127.0.0.1",
        "localhost",
        "10.0.0.1",
        "192.168.1.1",
        "169.254.169.254",
        "[::1]",
        "[::ffff:127.0.0.1]",
        "[fe80::1]",
        "0.0.0.0",
        "2130706433",
        "224.0.0.1",
        "100.64.0.1",
    ],
)
def test_addresses_that_only_this_machine_reaches_are_refused(host):
    with pytest.raises(Forbidden, match="not public"):
        destination(f"http://{host}/x", ())


def test_a_public_address_is_used_as_it_was_judged():
    found = destination("https://93.184.216.34:8443/hook?a=1", ())
    assert str(found.url) == "https://93.184.216.34:8443/hook?a=1"
    assert found.host == "93.184.216.34:8443"


def test_other_urls_are_not_stored(client, cell):
    for url in (
        "ftp://a.b/c",
        "file:///etc/passwd",
        "http://user:pw@a.b/",
        "http://a.b/#x",
        "javascript:1",
        "http:///x",
        "http://a..b/",
        f"http://{'a' * 64}.example/",
        "http://xn--a.example/",
        "http://xn--/",
        "http://a.b:99999/",
    ):
        answer = client.post("webhooks", json={"url": url, "events": ["drift.alarm"]})
        assert answer.status_code == 422
        assert "url" in answer.json()["detail"]


def test_a_name_in_other_letters_and_one_that_ends_in_a_dot_are_stored(client, cell):
    for url in ("https://bücher.example/", "https://xn--bcher-kva.example/", "https://a.example./"):
        subscribe(client, url, "drift.alarm")


def test_a_host_stored_before_it_was_refused_fails_and_the_others_are_served(
    client, cell, database, settings
):
    with receiver(204) as heard:
        old = subscribe(client, heard.url, "drift.alarm")
        with database.write() as session:
            session.connection().exec_driver_sql("UPDATE webhook SET url = 'http://a..b/'")
        other = subscribe(client, heard.url, "drift.alarm")
        for hook in (old, other):
            client.post(f"webhooks/{hook['id']}/test")
        sending = sender(database, settings, webhook_attempts=1)
        assert [sending.send_next() for _ in range(3)] == [True, True, False]
    assert log(client, other["id"])[0]["state"] == "delivered"
    (entry,) = log(client, old["id"])
    assert entry["state"] == "failed"
    assert "no name that can be looked up" in entry["outcome"]


NOT_NOTED = """
CREATE TRIGGER not_noted BEFORE UPDATE OF outcome ON webhook_delivery WHEN new.id = 1
BEGIN SELECT RAISE(ABORT, 'not noted'); END
"""


def test_a_delivery_that_cannot_be_noted_does_not_silence_the_sender(
    client, cell, database, settings, caplog
):
    with database.write() as session:
        session.connection().exec_driver_sql(NOT_NOTED)
    with receiver(204) as heard:
        hook = subscribe(client, heard.url, "drift.alarm")
        for _ in range(2):
            client.post(f"webhooks/{hook['id']}/test")
        sending = sender(database, settings)
        thread = threading.Thread(target=sending.run)
        thread.start()
        while thread.is_alive() and log(client, hook["id"])[0]["state"] == "pending":
            threading.Event().wait(0.01)
        sending.shutdown.set()
        thread.join()
    assert [entry["state"] for entry in log(client, hook["id"])] == ["delivered", "pending"]
    assert "a delivery was not sent" in caplog.text


def test_only_what_was_subscribed_to_is_sent(client, cell, database):
    with receiver(204) as heard:
        other = dict(cell, name="c2")
        client.post("cells", json=other)
        elsewhere = subscribe(client, heard.url, "campaign.finished", cell="c2")
        released = subscribe(client, heard.url, "parameters.released")
        everywhere = subscribe(client, heard.url, "campaign.finished", "drift.alarm")
        client.post("campaigns", json=CAMPAIGN)
        client.post("campaigns/1/abort")
    assert log(client, elsewhere["id"]) == []
    assert log(client, released["id"]) == []
    assert len(log(client, everywhere["id"])) == 1


def test_a_removed_webhook_is_gone_and_sends_nothing_more(client, cell, database, settings):
    with receiver(204) as heard:
        hook = subscribe(client, heard.url, "campaign.finished")
        client.post(f"webhooks/{hook['id']}/test")
        assert client.post(f"webhooks/{hook['id']}/remove").json()["removed"] is True
        assert not sender(database, settings).send_next()
    assert heard.requests == []
    assert client.get(f"webhooks/{hook['id']}").status_code == 404
    assert client.get("webhooks").json()["webhooks"] == []


def test_the_secret_is_shown_once(client, cell):
    body = {"url": "https://mes.plant.example/hook", "events": ["drift.alarm"]}
    key = {"Idempotency-Key": "hook-1"}
    hook = client.post("webhooks", json=body, headers=key).json()
    again = client.post("webhooks", json=body, headers=key).json()
    assert (again["id"], again["secret"]) == (hook["id"], "shown in the first answer alone")
    assert len(hook["secret"]) >= 43
    assert hook["secret"] not in client.get("webhooks").text
    assert hook["secret"] not in client.get(f"webhooks/{hook['id']}").text


def test_two_senders_do_not_send_the_same_delivery(client, cell, database, settings):
    with receiver(204) as heard:
        hook = subscribe(client, heard.url, "drift.alarm")
        for _ in range(6):
            client.post(f"webhooks/{hook['id']}/test")
        senders = [sender(database, settings) for _ in range(3)]

        def drain(sending: Sender) -> None:
            while sending.send_next():
                pass

        threads = [threading.Thread(target=drain, args=(sending,)) for sending in senders]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    numbers = [headers["Robocal-Delivery"] for headers, _ in heard.requests]
    assert len(numbers) == len(set(numbers)) == 6

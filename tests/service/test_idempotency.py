import threading


def test_the_same_key_and_body_give_the_same_answer_and_one_campaign(client, cell):
    body = {"cell": "c1", "kind": "calibrate", "poses": 8}
    headers = {"Idempotency-Key": "order-17"}
    first = client.post("campaigns", json=body, headers=headers)
    second = client.post("campaigns", json=body, headers=headers)
    assert first.status_code == second.status_code == 202
    assert first.content == second.content
    assert len(client.get("campaigns").json()["campaigns"]) == 1


def test_the_same_key_with_another_body_or_path_is_refused(client, cell):
    body = {"cell": "c1", "kind": "calibrate", "poses": 8}
    headers = {"Idempotency-Key": "order-17"}
    client.post("campaigns", json=body, headers=headers)
    other_body = client.post("campaigns", json=body | {"poses": 9}, headers=headers)
    other_path = client.post("cells/c1/disarm", headers=headers)
    for answer in (other_body, other_path):
        assert answer.status_code == 422
        assert "order-17" in answer.json()["detail"]
    assert client.get("cells/c1").json()["armed"] is True
    assert len(client.get("campaigns").json()["campaigns"]) == 1


def test_a_refused_request_does_not_use_up_its_key(client, cell):
    headers = {"Idempotency-Key": "order-18"}
    body = {"cell": "c1", "kind": "calibrate", "poses": 8}
    client.post("cells/c1/disarm")
    assert client.post("campaigns", json=body, headers=headers).status_code == 409
    client.post("cells/c1/arm")
    assert client.post("campaigns", json=body, headers=headers).status_code == 202


def test_without_a_key_every_post_counts(client, cell):
    body = {"cell": "c1", "kind": "calibrate", "poses": 8}
    first, second = (client.post("campaigns", json=body).json() for _ in range(2))
    assert first["id"] != second["id"]


def test_one_key_sent_many_times_at_once_makes_one_campaign(client, cell):
    body = {"cell": "c1", "kind": "calibrate", "poses": 8}
    answers = []

    def send() -> None:
        headers = {"Idempotency-Key": "storm"}
        answers.append(client.post("campaigns", json=body, headers=headers))

    threads = [threading.Thread(target=send) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {answer.content for answer in answers} == {answers[0].content}
    assert len(client.get("campaigns").json()["campaigns"]) == 1


def test_a_check_with_a_key_is_answered_again_without_asking_the_devices(client, cell):
    headers = {"Idempotency-Key": "check-1"}
    first = client.post("cells/c1/check", headers=headers)
    assert client.post("cells/c1/check", headers=headers).content == first.content

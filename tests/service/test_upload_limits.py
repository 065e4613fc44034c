import io
import zipfile

import pytest

from service.settings import Settings


@pytest.fixture
def settings(database_url) -> Settings:
    return Settings(database_url=database_url, upload_max_mb=0.2, unpacked_max_mb=1)


def test_an_upload_that_is_too_large_is_refused_before_it_is_read_whole(client):
    for options in ({"content": bytes(400_000)}, {"files": {"f": ("b.zip", bytes(400_000))}}):
        answer = client.post("campaigns/import", **options)
        assert answer.status_code == 422
        assert "larger than 0.2 MB" in answer.json()["detail"]


def test_a_bomb_is_refused_and_nothing_is_stored(client):
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("measurements.csv", bytes(50_000_000))
    answer = client.post("campaigns/import", content=target.getvalue())
    assert answer.status_code == 422
    assert "unpacks" in answer.json()["detail"]
    assert client.get("campaigns").json()["campaigns"] == []

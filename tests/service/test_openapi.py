from pathlib import Path

from service.main import openapi_text

COMMITTED = Path(__file__).parents[2] / "openapi.json"


def test_the_committed_description_is_the_one_the_service_gives():
    assert COMMITTED.read_text(encoding="utf-8") == openapi_text(), (
        "run `python -m service.main --openapi > openapi.json` and look at the difference"
    )

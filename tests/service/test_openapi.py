import json
from pathlib import Path

import pytest
from pydantic import BaseModel

from service.api_examples import ANSWERS, REQUESTS
from service.main import openapi_text

COMMITTED = Path(__file__).parents[2] / "openapi.json"
EXAMPLES = REQUESTS | ANSWERS


def test_the_committed_description_is_the_one_the_service_gives():
    assert COMMITTED.read_text(encoding="utf-8") == openapi_text(), (
        "run `python -m service.main --openapi > openapi.json` and look at the difference"
    )


def test_every_request_body_has_an_example_in_the_description():
    document = json.loads(COMMITTED.read_text(encoding="utf-8"))
    without = []
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            bodies = operation.get("requestBody", {}).get("content", {})
            schema = bodies.get("application/json", {}).get("schema")
            if schema is not None:
                # An optional body stands beside null.
                offered = [part["$ref"] for part in schema.get("anyOf", [schema]) if "$ref" in part]
                names = {reference.rpartition("/")[2] for reference in offered}
                shown = [document["components"]["schemas"][name].get("examples") for name in names]
                without += [] if shown and all(shown) else [f"{method} {path}"]
    assert not without


@pytest.mark.parametrize("model", EXAMPLES, ids=lambda model: model.__name__)
def test_an_example_is_what_its_model_takes(model: type[BaseModel]):
    example = EXAMPLES[model]
    kept = model.model_validate(example).model_dump(mode="json", exclude_unset=True)
    assert kept.keys() == example.keys()

"""Parameters as they go over HTTP, made once for every version and state of it.

What a version says is never changed, so its columns besides the document tell whether the answer
given before is still the right one.
"""

from collections import OrderedDict
from dataclasses import dataclass
from threading import Lock

from service.db.models import ParametersRow
from service.etag import tag_of
from service.parameters import store

_KEPT = 64


@dataclass(frozen=True)
class Answer:
    """A body and its tag."""

    body: str
    etag: str


class Answers:
    """The latest answers of one application."""

    def __init__(self) -> None:
        self._kept: OrderedDict[tuple[str | int | None, ...], Answer] = OrderedDict()
        self._lock = Lock()

    def of(self, row: ParametersRow) -> Answer:
        """Return the answer for a row, whose document is read only if it is needed."""
        key = (row.cell, row.version, row.state, row.campaign, row.created, row.released)
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]
        body = store.shown(row).model_dump_json()
        answer = Answer(body, tag_of(body))
        with self._lock:
            self._kept[key] = answer
            while len(self._kept) > _KEPT:
                self._kept.popitem(last=False)
        return answer

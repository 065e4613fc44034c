"""Idempotency-Key: a POST that is sent again gets the first answer and does nothing twice.

The answer is stored in the transaction that does the work: after a crash there are both or none.
"""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from http import HTTPStatus
from typing import TypeVar

from fastapi import Response
from pydantic import BaseModel
from sqlalchemy.orm import Session

from service.access.trail import Deed
from service.clock import utc_now
from service.db.engine import Database
from service.db.models import AnswerRow
from service.errors import Unusable

Answer = TypeVar("Answer", bound=BaseModel)


@dataclass(frozen=True)
class Once:
    """One POST, with its key where the client gave one.

    Parameters
    ----------
    key
        Idempotency-Key, or None.
    request_sha256
        Of method, path, query and body.
    deed
        What the audit trail shall keep, in the same transaction as the work.
    """

    database: Database
    key: str | None
    request_sha256: str
    deed: Deed

    def earlier(self) -> Response | None:
        """Return the answer that this key got before; raises `Unusable` for another request."""
        with self.database.read() as session:
            return self._stored(session)

    def answer(
        self,
        act: Callable[[Session], Answer],
        status: HTTPStatus = HTTPStatus.OK,
        kept: Callable[[Answer], BaseModel] | None = None,
    ) -> Response:
        """Do the work in one transaction and answer, or repeat the answer given before.

        `kept` makes what is stored of an answer that holds a secret.
        """
        with self.database.write() as session:
            earlier = self._stored(session)
            if earlier is not None:
                return earlier
            done = act(session)
            if self.key is not None:
                session.add(
                    AnswerRow(
                        key=self.key,
                        request_sha256=self.request_sha256,
                        status=status,
                        body=(done if kept is None else kept(done)).model_dump_json(),
                        created=utc_now(),
                    )
                )
            self.deed.write(session, status)
        self.deed.written = True
        return _json(done.model_dump_json(), status)

    def _stored(self, session: Session) -> Response | None:
        row = None if self.key is None else session.get(AnswerRow, self.key)
        if row is None:
            return None
        if row.request_sha256 != self.request_sha256:
            raise Unusable(
                f"Idempotency-Key '{self.key}' was used for another request; take a new key."
            )
        return _json(row.body, row.status)


def request_digest(method: str, target: str, body_sha256: str) -> str:
    """Hash what makes two requests the same."""
    return hashlib.sha256(f"{method} {target}\n{body_sha256}".encode()).hexdigest()


def _json(body: str, status: int) -> Response:
    return Response(body, status_code=status, media_type="application/json")

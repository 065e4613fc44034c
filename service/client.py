"""A small typed client of the REST API, for an MES or a script in Python.

    with Client("http://127.0.0.1:8300", key) as cell_service:
        version = cell_service.parameters("welding-3")
        joints = cell_service.compensate("welding-3", poses)

It loads httpx, pydantic and the models of the interface, nothing of the service or the numerics.
Every POST carries an `Idempotency-Key`, so that one whose answer was lost is sent again without
being done twice. Errors are `Refused` with the service's own sentence.
"""

import hashlib
import hmac
import time
import uuid
from collections.abc import Iterator, Sequence
from types import TracebackType
from typing import Literal, Self, TypeVar

import httpx
from pydantic import BaseModel

from robocal.orientation_of import OrientationOf
from service.campaigns.models import (
    ENDED,
    Accepted,
    Campaign,
    CampaignKind,
    Campaigns,
    CampaignState,
    NewCampaign,
)
from service.compensation.models import CompensatedJoints, CompensationRequest, Frame, WantedPose
from service.health_checks.models import CellHealth
from service.parameters.models import Decision, History, Parameters
from service.webhooks.models import NewWebhook, WebhookCreated, WebhookEvent

Model = TypeVar("Model", bound=BaseModel)

_ATTEMPTS = 3
_BETWEEN_S = 0.5
_TIMEOUT_S = 30.0
SIGNATURE_AGE_S = 300.0
"""From which on a signed delivery is too old to be believed [s]."""


class Refused(Exception):
    """The service refused; the message is its sentence."""

    def __init__(self, status: int, detail: str) -> None:
        super().__init__(detail)
        self.status = status


class Client:
    """One connection to a service; close it, or use it in a `with`.

    Parameters
    ----------
    address
        As in the service's ready line, `http://127.0.0.1:8300`.
    key
        API key with the scope that the calls need.
    """

    def __init__(self, address: str, key: str) -> None:
        headers = {"Authorization": f"Bearer {key}"}
        base = f"{address.rstrip('/')}/api/v1"
        self._http = httpx.Client(base_url=base, headers=headers, timeout=_TIMEOUT_S)
        self._known: dict[str, tuple[str, Parameters]] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the connection."""
        self._http.close()

    def parameters(self, cell: str) -> Parameters:
        """Return the released parameters; one that is known already is not sent again."""
        path = f"/cells/{cell}/parameters"
        etag, known = self._known.get(path, ("", None))
        answer = self._send("GET", path, headers={"If-None-Match": etag} if known else {})
        if answer.status_code == httpx.codes.NOT_MODIFIED and known is not None:
            return known
        found = Parameters.model_validate_json(answer.content)
        self._known[path] = (answer.headers["ETag"], found)
        return found

    def compensate(
        self,
        cell: str,
        poses: Sequence[WantedPose],
        frame: Frame = Frame.cell,
        temperature_degc: float | None = None,
        orientation_of: OrientationOf | None = None,
    ) -> CompensatedJoints:
        """Return the joints that really reach the poses."""
        request = CompensationRequest(
            poses=list(poses),
            frame=frame,
            temperature_degc=temperature_degc,
            orientation_of=orientation_of,
        )
        return self._post(f"/cells/{cell}/compensate", request, CompensatedJoints)

    def start(self, campaign: NewCampaign) -> Accepted:
        """Queue a campaign; the cell must be armed."""
        return self._post("/campaigns", campaign, Accepted)

    def campaign(self, number: int) -> Campaign:
        """State and progress of a campaign."""
        return Campaign.model_validate_json(self._send("GET", f"/campaigns/{number}").content)

    def campaigns(
        self,
        state: CampaignState | None = None,
        cell: str | None = None,
        kind: CampaignKind | None = None,
    ) -> Iterator[Campaign]:
        """Every campaign that fits, newest first, page by page."""
        wanted = {"state": state, "cell": cell, "kind": kind}
        query: dict[str, str | int] = {k: v for k, v in wanted.items() if v is not None}
        while True:
            answer = self._send("GET", "/campaigns", params=query)
            page = Campaigns.model_validate_json(answer.content)
            yield from page.campaigns
            if page.next_before is None:
                return
            query["before"] = page.next_before

    def watch(self, number: int) -> Iterator[Campaign]:
        """Give a campaign at each of its changes, as they come, until it has ended."""
        revision, failures = 0, 0
        while True:
            try:
                for campaign in self._changes(number, revision):
                    yield campaign
                    if campaign.state in ENDED:
                        return
                    revision, failures = campaign.revision, 0
            except httpx.TransportError:
                failures += 1
                if failures == _ATTEMPTS:
                    raise
            time.sleep(_BETWEEN_S)

    def certificate(
        self, number: int, written: Literal["html", "pdf"] = "pdf", version: int | None = None
    ) -> bytes:
        """Return the certificate of a campaign's version, by default of the one furthest on."""
        query: dict[str, str | int] = {"format": written}
        query |= {} if version is None else {"version": version}
        return self._send("GET", f"/campaigns/{number}/certificate", params=query).content

    def release(self, cell: str, version: int, reason: str = "") -> Parameters:
        """Let the MES use a version."""
        path = f"/cells/{cell}/parameters/{version}/release"
        return self._post(path, Decision(reason=reason), Parameters)

    def rollback(self, cell: str, version: int, reason: str = "") -> Parameters:
        """Let the MES use an earlier released version again."""
        path = f"/cells/{cell}/parameters/{version}/rollback"
        return self._post(path, Decision(reason=reason), Parameters)

    def history(self, cell: str) -> History:
        """Who did what to which version, newest first."""
        answer = self._send("GET", f"/cells/{cell}/parameters/history")
        return History.model_validate_json(answer.content)

    def health(self, cell: str) -> CellHealth:
        """The trend of a cell's health checks, newest first."""
        return CellHealth.model_validate_json(self._send("GET", f"/cells/{cell}/health").content)

    def subscribe(self, url: str, events: Sequence[WebhookEvent]) -> WebhookCreated:
        """Have events sent to a URL; keep the secret of the answer."""
        return self._post("/webhooks", NewWebhook(url=url, events=list(events)), WebhookCreated)

    def _post(self, path: str, body: BaseModel, model: type[Model]) -> Model:
        headers = {"Idempotency-Key": str(uuid.uuid4()), "Content-Type": "application/json"}
        content = body.model_dump_json(exclude_none=True).encode()
        answer = self._send("POST", path, headers=headers, content=content)
        return model.model_validate_json(answer.content)

    def _send(
        self,
        method: str,
        path: str,
        headers: dict[str, str] | None = None,
        params: dict[str, str | int] | None = None,
        content: bytes | None = None,
    ) -> httpx.Response:
        for attempt in range(1, _ATTEMPTS + 1):
            try:
                answer = self._http.request(
                    method, path, headers=headers, params=params, content=content
                )
                break
            except httpx.TransportError:
                # The key makes a second one harmless even where only the answer was lost.
                if attempt == _ATTEMPTS:
                    raise
                time.sleep(_BETWEEN_S * attempt)
        _require_success(answer)
        return answer

    def _changes(self, number: int, revision: int) -> Iterator[Campaign]:
        """States after a revision, until the service closes the stream."""
        headers = {"Last-Event-ID": str(revision)}
        with self._http.stream("GET", f"/campaigns/{number}/events", headers=headers) as answer:
            if answer.is_error:
                answer.read()
            _require_success(answer)
            name = ""
            for line in answer.iter_lines():
                field, _, value = line.partition(": ")
                if field == "event":
                    name = value
                elif field == "data" and name == "progress":
                    yield Campaign.model_validate_json(value)


def _require_success(answer: httpx.Response) -> None:
    if answer.is_error:
        problem = "application/problem+json" in answer.headers.get("Content-Type", "")
        detail = answer.json()["detail"] if problem else answer.reason_phrase
        raise Refused(answer.status_code, detail)


def is_genuine(secret: str, timestamp: str, signature: str, body: bytes, now: float) -> bool:
    """Whether a webhook delivery comes from the service, and is fresh.

    Parameters
    ----------
    timestamp, signature
        Headers `Robocal-Timestamp` and `Robocal-Signature`.
    now
        Seconds since 1970.
    """
    message = timestamp.encode() + b"." + body
    expected = "sha256=" + hmac.new(secret.encode(), message, hashlib.sha256).hexdigest()
    fresh = timestamp.isdigit() and abs(now - int(timestamp)) <= SIGNATURE_AGE_S
    return hmac.compare_digest(expected, signature) and fresh

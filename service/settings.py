"""Everything that an installation may set, each default once; by environment, ``ROBOCAL_PORT``."""

from ipaddress import ip_address, ip_network
from typing import Annotated, Literal, Self

from pydantic import (
    AfterValidator,
    Field,
    FilePath,
    PositiveFloat,
    PositiveInt,
    SecretStr,
    model_validator,
)
from pydantic_settings import BaseSettings, SettingsConfigDict

from service.db.engine import BUSY_S

OPEN = "open"
PLAINTEXT_WORD = "passwords-may-be-read-on-the-way"


def _address(host: str) -> str:
    if host != "localhost":
        ip_address(host)
    return host


def _network(text: str) -> str:
    return str(ip_network(text))


Network = Annotated[str, AfterValidator(_network)]


class Settings(BaseSettings):
    """Settings of the service and of its workers."""

    model_config = SettingsConfigDict(env_prefix="ROBOCAL_", extra="forbid")

    database_url: str = "sqlite:///var/robocal.sqlite3"
    busy_s: PositiveFloat = BUSY_S
    """How long a change waits for another process's change [s]."""
    disk_free_min_mb: PositiveFloat = 200.0
    """With less room on the database's disk the service says that it is not ready."""
    host: Annotated[str, AfterValidator(_address)] = "127.0.0.1"
    port: Annotated[int, Field(ge=0, le=65535)] = 8300
    """0 takes a free port; the ready line names it."""
    hosts: tuple[str, ...] = ()
    """Names besides the loopback ones in the Host header, of a proxy in front: `["cal.plant"]`."""

    bootstrap_key: Annotated[SecretStr, Field(min_length=32)] | None = None
    """A key for installations that must call before a person could make one."""
    access: Literal["required", "open"] = "required"
    """`open`: whoever reaches the service may do everything. For a try-out on one machine."""
    tls_cert: FilePath | None = None
    tls_key: FilePath | None = None
    tls_key_password: SecretStr | None = None
    plaintext_beyond_loopback: Literal["", "passwords-may-be-read-on-the-way"] = ""
    """The word that lets the service listen beyond this machine without TLS."""
    proxies: tuple[str, ...] = ()
    """Addresses of proxies whose X-Forwarded-For and -Proto are believed: `["127.0.0.1"]`."""
    login_hours: PositiveFloat = 12.0
    """How long a person stays logged in: a shift [h]."""

    log_level: Literal["INFO", "WARNING"] = "INFO"
    """From which level on lines are logged."""
    lease_s: PositiveFloat = 10.0
    """A worker that has not been heard of for so long has lost its job [s]."""
    idle_s: PositiveFloat = 0.3
    """How often an idle worker looks for a job [s]."""
    watch_s: PositiveFloat = 0.05
    """How often a working worker looks whether it is wanted to stop [s]."""

    events_poll_s: PositiveFloat = 0.2
    events_heartbeat_s: PositiveFloat = 15.0

    upload_max_mb: PositiveFloat = 100.0
    unpacked_max_mb: PositiveFloat = 200.0
    unpacked_ratio_max: PositiveFloat = 200.0
    unpacked_files_max: PositiveInt = 20
    json_max_mb: PositiveFloat = 16.0
    """Of any request but an upload."""

    webhook_networks: tuple[Network, ...] = ()
    """Networks that are not public and yet may receive webhooks: `["10.20.0.0/16"]`."""
    webhook_timeout_s: PositiveFloat = 10.0
    """Of one attempt, from connecting to the end of the answer's headers [s]."""
    webhook_retry_s: PositiveFloat = 10.0
    """After the first failed attempt; each further one waits twice as long, an hour at most [s]."""
    webhook_attempts: PositiveInt = 12
    """After so many a delivery is given up; by default that is after five hours."""

    @property
    def beyond_loopback(self) -> bool:
        """Whether other machines can reach the service."""
        return self.host != "localhost" and not ip_address(self.host).is_loopback

    @model_validator(mode="after")
    def _not_unguarded(self) -> Self:
        if (self.tls_cert is None) != (self.tls_key is None):
            raise ValueError("tls_cert and tls_key are given together or not at all")
        if self.access == OPEN and (self.beyond_loopback or self.hosts):
            raise ValueError(
                "access=open is for this machine alone: listen on 127.0.0.1 and name no hosts"
            )
        if self.beyond_loopback and self.tls_cert is None and not self.plaintext_beyond_loopback:
            raise ValueError(
                f"{self.host} can be reached from other machines, and passwords would go there in "
                "plain text: set ROBOCAL_TLS_CERT and ROBOCAL_TLS_KEY, or, behind a network of its "
                f"own, ROBOCAL_PLAINTEXT_BEYOND_LOOPBACK={PLAINTEXT_WORD}"
            )
        return self

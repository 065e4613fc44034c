"""Everything that an installation may set, each default once; by environment, ``ROBOCAL_PORT``."""

from ipaddress import ip_address
from typing import Annotated

from pydantic import AfterValidator, Field, PositiveFloat, PositiveInt
from pydantic_settings import BaseSettings, SettingsConfigDict

from service.db.engine import BUSY_S


def _loopback(host: str) -> str:
    if host != "localhost" and not ip_address(host).is_loopback:
        raise ValueError(
            f"{host} is not a loopback address; there is no authentication yet, "
            "so the service listens on 127.0.0.1 only"
        )
    return host


class Settings(BaseSettings):
    """Settings of the service and of its workers."""

    model_config = SettingsConfigDict(env_prefix="ROBOCAL_", extra="forbid")

    database_url: str = "sqlite:///var/robocal.sqlite3"
    busy_s: PositiveFloat = BUSY_S
    """How long a change waits for another process's change [s]."""
    host: Annotated[str, AfterValidator(_loopback)] = "127.0.0.1"
    port: Annotated[int, Field(ge=0, le=65535)] = 8300
    """0 takes a free port; the ready line names it."""
    hosts: tuple[str, ...] = ()
    """Names besides the loopback ones in the Host header, of a proxy in front: `["cal.plant"]`."""

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

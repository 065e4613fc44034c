"""Times in the future, as the database stores times."""

from datetime import UTC, datetime, timedelta


def in_hours(hours: float) -> str:
    """Return the moment so many hours from now; sorts as text with `utc_now`."""
    return (datetime.now(UTC) + timedelta(hours=hours)).isoformat(timespec="milliseconds")

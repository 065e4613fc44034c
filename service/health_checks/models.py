"""The trend of a cell's health as it goes over HTTP."""

from pydantic import BaseModel


class HealthPoint(BaseModel):
    """One health check."""

    campaign: int
    at: str
    parameters_version: int
    alarm: bool
    trend_alarm: bool
    chi_square: float
    chi_square_limit: float
    degrees_of_freedom: int
    p_value: float
    z: float
    """Chi-square as a standard normal statistic."""
    ewma: float | None
    """Trend since the version's first checks; null while these are gathered."""
    ewma_limit: float | None
    position_rms_mm: float
    temperature_degc: float | None
    moved: str | None
    """`base`, `tool`, `joint_3`, `temperature`; null without an alarm or without an explanation."""
    full_campaign_needed: bool
    advice: str


class CellHealth(BaseModel):
    """A page of a cell's health checks, newest first."""

    cell: str
    checks: list[HealthPoint]
    next_before: int | None
    """`?before=` of the next page; null on the last one."""

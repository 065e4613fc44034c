"""What a campaign counted from, and where in it rows that are predicted stand.

Rows are placed by the time they state, on the clock of that campaign. Rows that state none, or of
a campaign without times, stand at its end: what stepped has stepped, what drifted stays where it
was. A line of another file says nothing of when.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.measurements import MeasurementSet, approach_column

PAYLOAD = "payload_kg"


@dataclass(frozen=True)
class Reference:
    """What times, temperatures and speeds are counted from; kept with a model that uses them."""

    time_start: float = 0.0
    """[s]"""
    time_span: float = 1.0
    """[s]"""
    temperature: float = 20.0
    """[degC]"""
    speed: float = 1.0
    """Fraction of full speed."""
    timed: bool = True
    """Whether all rows stated their time; else a row's time is its number over the count [1]."""
    moments: tuple[tuple[float, float], ...] = ()
    """Lines of the campaign with their times [s]; none where they are not in the order of time."""
    complete: frozenset[str] = frozenset()
    """Columns of payload and approach that no row left empty."""

    @property
    def time_end(self) -> float:
        """When the campaign ended [s]."""
        return self.time_start + self.time_span

    def places(self, stated: Float[Array, "row"]) -> Bool[Array, "row"]:
        """Whether the time [s] that each row states says where in the campaign it stands."""
        return np.asarray(np.isfinite(stated) & self.timed)

    def time_at(self, stated: Float[Array, "row"]) -> Float[Array, "row"]:
        """Time of rows by what they state [s], held at the campaign's start and end."""
        time = np.where(self.places(stated), stated, self.time_end)
        return np.clip(time, self.time_start, self.time_end)

    def line_at(self, stated: Float[Array, "row"]) -> Float[Array, "row"]:
        """Line of the campaign by the time that rows state [s], infinite for its end."""
        if not self.moments:
            return np.full(len(stated), np.inf)
        lines, times = np.array(self.moments).T
        return np.where(self.places(stated), np.interp(stated, times, lines), np.inf)


def is_timed(rows: MeasurementSet) -> bool:
    """Whether all rows state their time, and not the same one."""
    return bool(np.isfinite(rows.time).all() and np.ptp(rows.time) > 0)


def reference_of(rows: MeasurementSet, time: Float[Array, "row"]) -> Reference:
    """What a campaign's rows count from.

    Parameters
    ----------
    time
        [s] where they state it, else the row's number over the count.
    """
    known = np.isfinite(rows.temperature)
    moved = np.isfinite(rows.speed) & (rows.speed > 0)
    timed = is_timed(rows)
    in_order = timed and (np.diff(rows.lines) > 0).all() and (np.diff(time) >= 0).all()
    moments = zip(rows.lines.tolist(), time.tolist(), strict=True)
    return Reference(
        float(time.min()),
        float(np.ptp(time)) or 1.0,
        float(rows.temperature[known].mean()) if known.any() else 20.0,
        float(rows.speed[moved].mean()) if moved.any() else 1.0,
        timed=timed,
        moments=tuple((float(line), moment) for line, moment in moments) if in_order else (),
        complete=_complete(rows),
    )


def _complete(rows: MeasurementSet) -> frozenset[str]:
    columns = {approach_column(joint + 1): side for joint, side in enumerate(rows.approach.T)}
    columns[PAYLOAD] = rows.payload
    return frozenset(name for name, cells in columns.items() if np.isfinite(cells).all())

"""Tables of several campaigns in one, on one clock and without two poses of the same number."""

from collections.abc import Sequence

from service.campaigns.table import MeasurementTable, Value


def pooled(tables: Sequence[MeasurementTable], starts_s: Sequence[float]) -> MeasurementTable:
    """Put tables one after the other; a column that one lacks is empty there.

    Parameters
    ----------
    tables
        Rows of measurements.csv, oldest campaign first.
    starts_s
        Of each, what is added to its `t_s` [s].
    """
    columns = tuple(dict.fromkeys(name for table in tables for name in table.columns))
    rows: list[tuple[Value, ...]] = []
    first_pose = 0
    for table, start_s in zip(tables, starts_s, strict=True):
        last_pose = first_pose - 1
        for record in table.objects():
            number = first_pose + _whole(record["pose"])
            last_pose = max(last_pose, number)
            record |= {"pose": number, "t_s": round(_real(record["t_s"]) + start_s, 3)}
            rows.append(tuple(record.get(name) for name in columns))
        first_pose = last_pose + 1
    return MeasurementTable(columns, tuple(rows))


def _whole(value: Value) -> int:
    assert isinstance(value, int)
    return value


def _real(value: Value) -> float:
    assert isinstance(value, int | float)
    return value

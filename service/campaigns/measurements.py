"""Readings as measurements.csv and as the bundle around it, in the units of the files."""

import csv
import io
import math
import zipfile
from collections.abc import Iterable
from dataclasses import dataclass

import yaml
from sqlalchemy import select
from sqlalchemy.orm import Session

from service.cells import store as cells
from service.cells.models import TrackerSettings
from service.db.models import BundleRow, CampaignRow, PoseRow, ReadingRow

ROBOT, CAMPAIGN, MEASUREMENTS = "robot.yaml", "campaign.yaml", "measurements.csv"
HELD_OUT_FRACTION = 0.25
_ZIP_DATE = (1980, 1, 1, 0, 0, 0)
_SECONDS = ("motion_s", "settling_s", "measuring_s", "overhead_s")
_TEXT_COLUMNS = ("target", "split")
_REMARK = "note_"
_FILE_UNIT = {"deg": 180.0 / math.pi, "mm": 1e3}

Value = float | int | str | None


@dataclass(frozen=True)
class MeasurementTable:
    """Rows under column names of measurements.csv."""

    columns: tuple[str, ...]
    rows: tuple[tuple[Value, ...], ...]

    def csv(self) -> str:
        """Return the text of measurements.csv."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.columns)
        writer.writerows(self.rows)
        return text.getvalue()

    def objects(self) -> list[dict[str, Value]]:
        """One mapping per row."""
        return [dict(zip(self.columns, row, strict=True)) for row in self.rows]


def measurements_csv(session: Session, row: CampaignRow) -> str:
    """Return the text of measurements.csv; an imported one as it came."""
    imported = session.get(BundleRow, row.id)
    if imported is None:
        return _measured(session, row).csv()
    with zipfile.ZipFile(io.BytesIO(imported.content)) as archive:
        return archive.read(MEASUREMENTS).decode("utf-8-sig")


def measurement_table(session: Session, row: CampaignRow) -> MeasurementTable:
    """Return what a campaign measured; for a driven one also how each reading came about."""
    if session.get(BundleRow, row.id) is not None:
        return _read_csv(measurements_csv(session, row))
    measured, course = _measured(session, row), _course(session, row)
    return MeasurementTable(
        (*measured.columns, *course.columns),
        tuple((*a, *b) for a, b in zip(measured.rows, course.rows, strict=True)),
    )


def _measured(session: Session, row: CampaignRow) -> MeasurementTable:
    readings = _readings(session, row)
    with_orientation = any(reading.orientation is not None for reading in readings)
    columns = _columns(row.joint_units, with_orientation=with_orientation)
    return MeasurementTable(
        columns,
        tuple(
            _row(reading, row.joint_units, with_orientation=with_orientation)
            for reading in readings
        ),
    )


def bundle_files(session: Session, row: CampaignRow) -> dict[str, bytes]:
    """Return the files of a driven campaign's bundle, the same bytes every time."""
    assert row.cell is not None
    tracker = cells.settings_of(cells.find(session, row.cell)).tracker
    return {
        ROBOT: row.robot_yaml.encode(),
        CAMPAIGN: _campaign_yaml(tracker, row.seed).encode(),
        MEASUREMENTS: _measured(session, row).csv().encode(),
    }


def bundle_zip(session: Session, row: CampaignRow) -> bytes:
    """Return the bundle of a campaign as .zip."""
    imported = session.get(BundleRow, row.id)
    return imported.content if imported is not None else zipped(bundle_files(session, row))


def zipped(files: dict[str, bytes]) -> bytes:
    """Files as .zip without the date, so that equal files give equal bytes."""
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name, _ZIP_DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content)
    return target.getvalue()


def _course(session: Session, row: CampaignRow) -> MeasurementTable:
    """Purpose, attempts, spread and the seconds on the host's clock, in the same order."""
    poses = session.scalars(select(PoseRow).where(PoseRow.campaign == row.id))
    purposes = {pose.idx: pose.purpose for pose in poses}
    return MeasurementTable(
        ("purpose", "attempt", "spread_mm", *_SECONDS),
        tuple(
            (
                purposes[reading.idx],
                reading.attempt,
                round(reading.spread * 1e3, 6),
                *(round(getattr(reading, name), 4) for name in _SECONDS),
            )
            for reading in _readings(session, row)
        ),
    )


def _readings(session: Session, row: CampaignRow) -> list[ReadingRow]:
    return list(
        session.scalars(
            select(ReadingRow)
            .where(ReadingRow.campaign == row.id)
            .order_by(ReadingRow.repeat, ReadingRow.idx)
        )
    )


def _campaign_yaml(tracker: TrackerSettings, seed: int) -> str:
    document = {
        "robot": ROBOT,
        "instrument": {
            "kind": tracker.kind,
            "sigma_mm": tracker.sigma_mm,
            "sigma_ppm": tracker.sigma_ppm,
            "sigma_mrad": tracker.sigma_mrad,
        },
        "gravity": [0, 0, -1],
        "held_out": {"fraction": HELD_OUT_FRACTION, "seed": seed},
    }
    return yaml.safe_dump(document, sort_keys=False)


def _columns(joint_units: list[str], *, with_orientation: bool) -> tuple[str, ...]:
    numbered = list(enumerate(joint_units, start=1))
    return (
        "pose",
        "repeat",
        *(f"j{i}_{unit}" for i, unit in numbered),
        *("x_mm", "y_mm", "z_mm"),
        *(("qw", "qx", "qy", "qz") if with_orientation else ()),
        *("t_s", "temperature_degc"),
        *(f"approach{i}" for i, _ in numbered),
        *("speed", "settle_s"),
        *(f"cmd{i}_{unit}" for i, unit in numbered),
    )


def _row(reading: ReadingRow, units: list[str], *, with_orientation: bool) -> tuple[Value, ...]:
    orientation: Iterable[Value] = ()
    if with_orientation:
        orientation = (None,) * 4
        if reading.orientation is not None:
            orientation = [round(part, 10) for part in reading.orientation]
    return (
        reading.idx,
        reading.repeat,
        *_in_file_units(reading.joints, units),
        *(round(part * 1e3, 6) for part in reading.position),
        *orientation,
        round(reading.t_s, 3),
        reading.temperature_degc,
        *reading.approach,
        round(reading.speed, 6),
        round(reading.settle_s, 4),
        *_in_file_units(reading.commanded, units),
    )


def _in_file_units(joints: list[float], units: list[str]) -> list[float]:
    return [round(q * _FILE_UNIT[unit], 9) for q, unit in zip(joints, units, strict=True)]


def _read_csv(text: str) -> MeasurementTable:
    header, *rows = csv.reader(io.StringIO(text))
    columns = tuple(name.strip() for name in header)
    return MeasurementTable(
        columns,
        tuple(
            tuple(_value(name, cell.strip()) for name, cell in zip(columns, row, strict=True))
            for row in rows
            if row
        ),
    )


def _value(column: str, cell: str) -> Value:
    if not cell:
        return None
    if column in _TEXT_COLUMNS or column.startswith(_REMARK):
        return cell
    return float(cell)

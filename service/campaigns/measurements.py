"""Readings as measurements.csv and as the bundle around it, in the units of the files."""

import csv
import io
import math
import zipfile
from dataclasses import dataclass

import yaml
from sqlalchemy import select
from sqlalchemy.orm import Session

from service.campaigns.lineage import lineage, starts_s
from service.campaigns.pooled import pooled
from service.campaigns.table import MeasurementTable, Value
from service.cells.models import NewCell
from service.db.models import BundleRow, CampaignRow, PoseRow, ReadingRow, ReferenceRow

ROBOT, CAMPAIGN, MEASUREMENTS = "robot.yaml", "campaign.yaml", "measurements.csv"
HELD_OUT_FRACTION = 0.25
_ZIP_DATE = (1980, 1, 1, 0, 0, 0)
_SECONDS = ("motion_s", "settling_s", "measuring_s", "overhead_s")
_QUATERNION = ("qw", "qx", "qy", "qz")
PURPOSE_REFERENCE = "reference"
_TEXT_COLUMNS = ("target", "split")
_REMARK = "note_"
_FILE_UNIT = {"deg": 180.0 / math.pi, "mm": 1e3}


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


def joint_readings(session: Session, row: CampaignRow) -> list[list[float]]:
    """Joints at which a campaign measured, driven or imported [rad or m]."""
    if session.get(BundleRow, row.id) is None:
        chain = lineage(session, row)
        return [reading.joints for one in chain for reading in _readings(session, one)]
    table = _read_csv(measurements_csv(session, row))
    names = [f"j{i}_{unit}" for i, unit in enumerate(row.joint_units, start=1)]
    places = [table.columns.index(name) for name in names]
    scale = [1.0 / _FILE_UNIT[unit] for unit in row.joint_units]
    return [
        [float(cells[k] or 0.0) * s for k, s in zip(places, scale, strict=True)]
        for cells in table.rows
    ]


def _measured(session: Session, row: CampaignRow) -> MeasurementTable:
    seen = _seen(session, row)
    with_orientation = any(entry.row.orientation is not None for entry in seen)
    with_target = _cell_of(row).references is not None
    columns = _columns(row.joint_units, with_orientation=with_orientation, with_target=with_target)
    values = [_values(entry, row.joint_units) for entry in seen]
    return MeasurementTable(
        columns, tuple(tuple(entry.get(name) for name in columns) for entry in values)
    )


def _pooled(session: Session, row: CampaignRow) -> MeasurementTable:
    """A follow-up's rows behind those of the campaigns that it follows."""
    chain = lineage(session, row)
    if len(chain) == 1:
        return _measured(session, row)
    return pooled([_measured(session, one) for one in chain], starts_s(session, chain))


def bundle_files(session: Session, row: CampaignRow) -> dict[str, bytes]:
    """Return the files of a driven campaign's bundle, the same bytes every time."""
    return {
        ROBOT: row.robot_yaml.encode(),
        CAMPAIGN: _campaign_yaml(_cell_of(row), row.seed).encode(),
        MEASUREMENTS: _pooled(session, row).csv().encode(),
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
                purposes[entry.reading.idx],
                entry.reading.attempt,
                round(entry.row.spread * 1e3, 6),
                *(round(getattr(entry.row, name), 4) for name in _SECONDS),
            )
            if isinstance(entry.row, ReadingRow)
            else (PURPOSE_REFERENCE, None, round(entry.row.spread * 1e3, 6), *[None] * 4)
            for entry in _seen(session, row)
        ),
    )


@dataclass(frozen=True)
class _Seen:
    """A reading, or one of a fixed nest beside the robot's pose at that time."""

    row: ReadingRow | ReferenceRow
    reading: ReadingRow


def _seen(session: Session, row: CampaignRow) -> list[_Seen]:
    """Everything that the tracker read, in the order of time."""
    nests = session.scalars(
        select(ReferenceRow).where(ReferenceRow.campaign == row.id).order_by(ReferenceRow.id)
    )
    after: dict[int, list[ReferenceRow]] = {}
    for nest in nests:
        after.setdefault(nest.after_readings, []).append(nest)
    seen = []
    for number, reading in enumerate(_readings(session, row), start=1):
        seen.append(_Seen(reading, reading))
        seen += [_Seen(nest, reading) for nest in after.get(number, [])]
    return seen


def _readings(session: Session, row: CampaignRow) -> list[ReadingRow]:
    query = select(ReadingRow).where(ReadingRow.campaign == row.id).order_by(ReadingRow.id)
    return list(session.scalars(query))


def _cell_of(row: CampaignRow) -> NewCell:
    """Return the cell as it was when the campaign was made."""
    return NewCell.model_validate(row.cell_document)


def _campaign_yaml(cell: NewCell, seed: int) -> str:
    tracker = cell.tracker
    document: dict[str, object] = {
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
    if cell.references is not None:
        document["targets"] = {nest.name: {"fixed": True} for nest in cell.references.nests}
    return yaml.safe_dump(document, sort_keys=False)


def _columns(
    joint_units: list[str], *, with_orientation: bool, with_target: bool
) -> tuple[str, ...]:
    numbered = list(enumerate(joint_units, start=1))
    return (
        "pose",
        "repeat",
        *(("target",) if with_target else ()),
        *(f"j{i}_{unit}" for i, unit in numbered),
        *("x_mm", "y_mm", "z_mm"),
        *(_QUATERNION if with_orientation else ()),
        *("t_s", "temperature_degc", "payload_kg"),
        *(f"approach{i}" for i, _ in numbered),
        *("speed", "settle_s"),
        *(f"cmd{i}_{unit}" for i, unit in numbered),
    )


def _values(seen: _Seen, units: list[str]) -> dict[str, Value]:
    """Return the cells of one row by their columns; what a nest's row lacks is missing."""
    row = seen.row
    numbered = list(enumerate(units, start=1))
    joints = in_file_units(row.joints, units)
    values: dict[str, Value] = {
        "pose": seen.reading.idx,
        "repeat": seen.reading.repeat,
        "t_s": round(row.t_s, 3),
        "temperature_degc": row.temperature_degc,
        **{f"j{i}_{unit}": q for (i, unit), q in zip(numbered, joints, strict=True)},
        **{f"{axis}_mm": round(p * 1e3, 6) for axis, p in zip("xyz", row.position, strict=True)},
    }
    if row.orientation is not None:
        parts = zip(_QUATERNION, row.orientation, strict=True)
        values |= {name: round(part, 10) for name, part in parts}
    if isinstance(row, ReferenceRow):
        return values | {"target": row.target}
    commanded = in_file_units(row.commanded, units)
    return values | {
        "payload_kg": row.payload_kg,
        **{f"approach{i}": sign for i, sign in enumerate(row.approach, start=1)},
        "speed": round(row.speed, 6),
        "settle_s": round(row.settle_s, 4),
        **{f"cmd{i}_{unit}": q for (i, unit), q in zip(numbered, commanded, strict=True)},
    }


def in_file_units(joints: list[float], units: list[str]) -> list[float]:
    """Return joint readings [rad, m] in the units of files."""
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

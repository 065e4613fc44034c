"""Why poses are skipped, approach, payload, fixed nests, and the cell as it was."""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None


MOST_SPEED_DEG_S = 90.0
"""Cells may no longer be faster: a stop from more takes longer than 0.3 s."""


def _slow_down_cells() -> None:
    cell = sa.table("cell", sa.column("name", sa.Text()), sa.column("document", sa.JSON()))
    for name, document in op.get_bind().execute(sa.select(cell.c.name, cell.c.document)).all():
        limits = document.get("limits", {})
        if limits.get("speed_deg_s", 0.0) > MOST_SPEED_DEG_S:
            slower = document | {"limits": limits | {"speed_deg_s": MOST_SPEED_DEG_S}}
            op.execute(cell.update().where(cell.c.name == name).values(document=slower))


def upgrade() -> None:
    _slow_down_cells()
    op.add_column("campaign", sa.Column("cell_document", sa.JSON(), nullable=True))
    op.add_column("campaign", sa.Column("payload_kg", sa.Double(), nullable=True))
    for column in ("approach_turn", "approach_slide"):
        op.add_column(
            "campaign", sa.Column(column, sa.Double(), nullable=False, server_default="0")
        )
    op.execute(
        "UPDATE campaign SET cell_document = "
        "(SELECT document FROM cell WHERE cell.name = campaign.cell)"
    )
    op.add_column("pose", sa.Column("reason", sa.Text(), nullable=False, server_default=""))
    op.add_column("reading", sa.Column("payload_kg", sa.Double(), nullable=True))
    op.create_table(
        "reference_reading",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("campaign", sa.Integer(), nullable=False),
        sa.Column("target", sa.Text(), nullable=False),
        sa.Column("fence", sa.Integer(), nullable=False),
        sa.Column("joints", sa.JSON(), nullable=False),
        sa.Column("position", sa.JSON(), nullable=False),
        sa.Column("orientation", sa.JSON(), nullable=True),
        sa.Column("spread", sa.Double(), nullable=False),
        sa.Column("shots", sa.Integer(), nullable=False),
        sa.Column("temperature_degc", sa.Double(), nullable=True),
        sa.Column("robot_time_s", sa.Double(), nullable=False),
        sa.Column("tracker_time_s", sa.Double(), nullable=False),
        sa.Column("t_s", sa.Double(), nullable=False),
        sa.Column("after_readings", sa.Integer(), nullable=False),
        sa.Column("created", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(
            ["campaign"], ["campaign.id"], name=op.f("fk_reference_reading_campaign")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_reference_reading")),
    )
    op.create_index(
        op.f("ix_reference_reading_campaign"), "reference_reading", ["campaign"], unique=False
    )
    if op.get_bind().dialect.name == "sqlite":
        for change in ("UPDATE", "DELETE"):
            op.execute(
                f"CREATE TRIGGER reference_reading_no_{change.lower()} "
                f"BEFORE {change} ON reference_reading "
                "BEGIN SELECT RAISE(ABORT, 'a reading is never changed'); END"
            )
    else:
        op.execute(
            "CREATE TRIGGER reference_reading_no_change BEFORE UPDATE OR DELETE "
            "ON reference_reading FOR EACH ROW EXECUTE FUNCTION reading_is_never_changed()"
        )


def downgrade() -> None:
    op.drop_table("reference_reading")
    op.drop_column("reading", "payload_kg")
    op.drop_column("pose", "reason")
    for column in ("approach_slide", "approach_turn", "payload_kg", "cell_document"):
        op.drop_column("campaign", column)

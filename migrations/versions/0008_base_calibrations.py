"""Base-to-base calibrations: their touches, and the transforms that they make."""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "base_calibration",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("state", sa.Text(), nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("document", sa.JSON(), nullable=False),
        sa.Column("robots", sa.JSON(), nullable=False),
        sa.Column("assessment", sa.JSON(), nullable=True),
        sa.Column("assessed", sa.Integer(), nullable=False),
        sa.Column("created", sa.Text(), nullable=False),
        sa.Column("finished", sa.Text(), nullable=True),
        sa.CheckConstraint(
            "state IN ('touching','finished')", name=op.f("ck_base_calibration_state")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_base_calibration")),
    )
    op.create_table(
        "stage_touch",
        sa.Column("calibration", sa.Integer(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("robot", sa.Text(), nullable=False),
        sa.Column("cup", sa.Text(), nullable=False),
        sa.Column("placement", sa.Integer(), nullable=False),
        sa.Column("joints", sa.JSON(), nullable=False),
        sa.Column("readings", sa.JSON(), nullable=False),
        sa.Column("spreads", sa.JSON(), nullable=False),
        sa.Column("shots", sa.Integer(), nullable=False),
        sa.Column("created", sa.Text(), nullable=False),
        sa.Column("voided", sa.Text(), nullable=True),
        sa.Column("void_reason", sa.Text(), nullable=False),
        sa.CheckConstraint("robot IN ('master','slave')", name=op.f("ck_stage_touch_robot")),
        sa.CheckConstraint("cup IN ('rod','slide')", name=op.f("ck_stage_touch_cup")),
        sa.ForeignKeyConstraint(
            ["calibration"], ["base_calibration.id"], name=op.f("fk_stage_touch_calibration")
        ),
        sa.PrimaryKeyConstraint("calibration", "number", name=op.f("pk_stage_touch")),
    )
    op.create_table(
        "base_transform",
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("state", sa.Text(), nullable=False),
        sa.Column("calibration", sa.Integer(), nullable=False),
        sa.Column("document", sa.JSON(), nullable=False),
        sa.Column("bundle_sha256", sa.Text(), nullable=False),
        sa.Column("software_version", sa.Text(), nullable=False),
        sa.Column("settings", sa.JSON(), nullable=False),
        sa.Column("created", sa.Text(), nullable=False),
        sa.Column("released", sa.Text(), nullable=True),
        sa.CheckConstraint(
            "state IN ('candidate','released','superseded')",
            name=op.f("ck_base_transform_state"),
        ),
        sa.ForeignKeyConstraint(
            ["calibration"], ["base_calibration.id"], name=op.f("fk_base_transform_calibration")
        ),
        sa.PrimaryKeyConstraint("name", "version", name=op.f("pk_base_transform")),
        sa.UniqueConstraint("calibration", name=op.f("uq_base_transform_calibration")),
    )
    with op.batch_alter_table("base_transform") as batch_op:
        batch_op.create_index(
            "one_released_per_pair",
            ["name"],
            unique=True,
            sqlite_where=sa.text("state = 'released'"),
            postgresql_where=sa.text("state = 'released'"),
        )
    op.create_table(
        "base_transform_event",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("event", sa.Text(), nullable=False),
        sa.Column("person", sa.Text(), nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
        sa.Column("at", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(
            ["name", "version"],
            ["base_transform.name", "base_transform.version"],
            name=op.f("fk_base_transform_event_name_version"),
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_base_transform_event")),
    )
    with op.batch_alter_table("base_transform_event") as batch_op:
        batch_op.create_index(batch_op.f("ix_base_transform_event_name"), ["name"], unique=False)
    _protect_history()


def _protect_history() -> None:
    sentence = "the history of base transforms is never changed"
    if op.get_bind().dialect.name == "sqlite":
        for change in ("UPDATE", "DELETE"):
            op.execute(
                f"CREATE TRIGGER base_transform_event_no_{change.lower()} BEFORE {change} "
                f"ON base_transform_event BEGIN SELECT RAISE(ABORT, '{sentence}'); END"
            )
    else:
        op.execute(
            "CREATE FUNCTION base_transform_event_is_never_changed() RETURNS trigger "
            f"LANGUAGE plpgsql AS $$ BEGIN RAISE EXCEPTION '{sentence}'; END $$"
        )
        op.execute(
            "CREATE TRIGGER base_transform_event_no_change BEFORE UPDATE OR DELETE ON "
            "base_transform_event FOR EACH ROW "
            "EXECUTE FUNCTION base_transform_event_is_never_changed()"
        )


def downgrade() -> None:
    op.drop_table("base_transform_event")
    if op.get_bind().dialect.name == "postgresql":
        op.execute("DROP FUNCTION base_transform_event_is_never_changed()")
    op.drop_table("base_transform")
    op.drop_table("stage_touch")
    op.drop_table("base_calibration")

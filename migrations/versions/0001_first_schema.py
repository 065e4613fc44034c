"""First schema: cells, campaigns, jobs, poses, immutable readings, results, parameters."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "answer",
        sa.Column("key", sa.Text(), nullable=False),
        sa.Column("request_sha256", sa.Text(), nullable=False),
        sa.Column("status", sa.Integer(), nullable=False),
        sa.Column("body", sa.Text(), nullable=False),
        sa.Column("created", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("key", name=op.f("pk_answer")),
    )
    op.create_table(
        "cell",
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("document", sa.JSON(), nullable=False),
        sa.Column("armed", sa.Boolean(), nullable=False),
        sa.Column("created", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("name", name=op.f("pk_cell")),
    )
    op.create_table(
        "campaign",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("cell", sa.Text(), nullable=True),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("state", sa.Text(), nullable=False),
        sa.Column("wish", sa.Text(), nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("pose_count", sa.Integer(), nullable=False),
        sa.Column("repeats", sa.Integer(), nullable=False),
        sa.Column("settle_s", sa.Double(), nullable=False),
        sa.Column("seed", sa.Integer(), nullable=False),
        sa.Column("robot_yaml", sa.Text(), nullable=False),
        sa.Column("joint_units", sa.JSON(), nullable=False),
        sa.Column("parameters_version", sa.Integer(), nullable=True),
        sa.Column("created", sa.Text(), nullable=False),
        sa.Column("started", sa.Text(), nullable=True),
        sa.Column("finished", sa.Text(), nullable=True),
        sa.CheckConstraint(
            "state IN ('queued','running','paused','finished','aborted','failed')",
            name=op.f("ck_campaign_state"),
        ),
        sa.ForeignKeyConstraint(["cell"], ["cell.name"], name=op.f("fk_campaign_cell")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_campaign")),
    )
    op.create_table(
        "bundle",
        sa.Column("campaign", sa.Integer(), nullable=False),
        sa.Column("content", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(["campaign"], ["campaign.id"], name=op.f("fk_bundle_campaign")),
        sa.PrimaryKeyConstraint("campaign", name=op.f("pk_bundle")),
    )
    op.create_table(
        "job",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("campaign", sa.Integer(), nullable=False),
        sa.Column("cell", sa.Text(), nullable=True),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("state", sa.Text(), nullable=False),
        sa.Column("fence", sa.Integer(), nullable=False),
        sa.Column("lease_until", sa.Double(), nullable=False),
        sa.Column("worker", sa.Text(), nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
        sa.Column("created", sa.Text(), nullable=False),
        sa.Column("finished", sa.Text(), nullable=True),
        sa.CheckConstraint(
            "state IN ('queued','running','held','done','failed','cancelled')",
            name=op.f("ck_job_state"),
        ),
        sa.ForeignKeyConstraint(["campaign"], ["campaign.id"], name=op.f("fk_job_campaign")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_job")),
    )
    with op.batch_alter_table("job", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_job_campaign"), ["campaign"], unique=False)
        batch_op.create_index(batch_op.f("ix_job_state"), ["state"], unique=False)
        batch_op.create_index(
            "one_running_job_per_cell",
            ["cell"],
            unique=True,
            sqlite_where=sa.text("state = 'running'"),
            postgresql_where=sa.text("state = 'running'"),
        )

    op.create_table(
        "parameters",
        sa.Column("cell", sa.Text(), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("state", sa.Text(), nullable=False),
        sa.Column("document", sa.JSON(), nullable=False),
        sa.Column("campaign", sa.Integer(), nullable=False),
        sa.Column("created", sa.Text(), nullable=False),
        sa.Column("released", sa.Text(), nullable=True),
        sa.CheckConstraint(
            "state IN ('candidate','released','superseded')", name=op.f("ck_parameters_state")
        ),
        sa.ForeignKeyConstraint(["campaign"], ["campaign.id"], name=op.f("fk_parameters_campaign")),
        sa.ForeignKeyConstraint(["cell"], ["cell.name"], name=op.f("fk_parameters_cell")),
        sa.PrimaryKeyConstraint("cell", "version", name=op.f("pk_parameters")),
    )
    with op.batch_alter_table("parameters", schema=None) as batch_op:
        batch_op.create_index(
            "one_released_per_cell",
            ["cell"],
            unique=True,
            sqlite_where=sa.text("state = 'released'"),
            postgresql_where=sa.text("state = 'released'"),
        )

    op.create_table(
        "pose",
        sa.Column("campaign", sa.Integer(), nullable=False),
        sa.Column("idx", sa.Integer(), nullable=False),
        sa.Column("state", sa.Text(), nullable=False),
        sa.Column("attempt", sa.Integer(), nullable=False),
        sa.Column("commanded", sa.JSON(), nullable=False),
        sa.Column("approach", sa.JSON(), nullable=True),
        sa.Column("purpose", sa.Text(), nullable=False),
        sa.CheckConstraint("state IN ('planned','measured','skipped')", name=op.f("ck_pose_state")),
        sa.ForeignKeyConstraint(["campaign"], ["campaign.id"], name=op.f("fk_pose_campaign")),
        sa.PrimaryKeyConstraint("campaign", "idx", name=op.f("pk_pose")),
    )
    op.create_table(
        "result",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("campaign", sa.Integer(), nullable=False),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("document", sa.JSON(), nullable=False),
        sa.Column("model_yaml", sa.Text(), nullable=True),
        sa.Column("bundle_sha256", sa.Text(), nullable=False),
        sa.Column("software_version", sa.Text(), nullable=False),
        sa.Column("settings", sa.JSON(), nullable=False),
        sa.Column("created", sa.Text(), nullable=False),
        sa.CheckConstraint(
            "kind IN ('identification','uncertainty','verification')", name=op.f("ck_result_kind")
        ),
        sa.ForeignKeyConstraint(["campaign"], ["campaign.id"], name=op.f("fk_result_campaign")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_result")),
    )
    with op.batch_alter_table("result", schema=None) as batch_op:
        batch_op.create_index(
            batch_op.f("ix_result_campaign_kind"), ["campaign", "kind"], unique=False
        )

    op.create_table(
        "reading",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("campaign", sa.Integer(), nullable=False),
        sa.Column("idx", sa.Integer(), nullable=False),
        sa.Column("repeat", sa.Integer(), nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("attempt", sa.Integer(), nullable=False),
        sa.Column("fence", sa.Integer(), nullable=False),
        sa.Column("joints", sa.JSON(), nullable=False),
        sa.Column("commanded", sa.JSON(), nullable=False),
        sa.Column("position", sa.JSON(), nullable=False),
        sa.Column("orientation", sa.JSON(), nullable=True),
        sa.Column("spread", sa.Double(), nullable=False),
        sa.Column("shots", sa.Integer(), nullable=False),
        sa.Column("temperature_degc", sa.Double(), nullable=True),
        sa.Column("approach", sa.JSON(), nullable=False),
        sa.Column("speed", sa.Double(), nullable=False),
        sa.Column("settle_s", sa.Double(), nullable=False),
        sa.Column("robot_time_s", sa.Double(), nullable=False),
        sa.Column("tracker_time_s", sa.Double(), nullable=False),
        sa.Column("t_s", sa.Double(), nullable=False),
        sa.Column("motion_s", sa.Double(), nullable=False),
        sa.Column("settling_s", sa.Double(), nullable=False),
        sa.Column("measuring_s", sa.Double(), nullable=False),
        sa.Column("overhead_s", sa.Double(), nullable=False),
        sa.Column("created", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(
            ["campaign", "idx"], ["pose.campaign", "pose.idx"], name=op.f("fk_reading_campaign_idx")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_reading")),
        sa.UniqueConstraint(
            "campaign", "idx", "repeat", name=op.f("uq_reading_campaign_idx_repeat")
        ),
    )
    if op.get_bind().dialect.name == "sqlite":
        for change in ("UPDATE", "DELETE"):
            op.execute(
                f"CREATE TRIGGER reading_no_{change.lower()} BEFORE {change} ON reading "
                "BEGIN SELECT RAISE(ABORT, 'a reading is never changed'); END"
            )


def downgrade() -> None:
    for table in (
        "reading",
        "result",
        "pose",
        "parameters",
        "job",
        "bundle",
        "campaign",
        "cell",
        "answer",
    ):
        op.drop_table(table)

"""Diagnosis: its results with their files, computations that are asked for again, follow-ups."""

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None

KINDS = "kind IN ('identification','uncertainty','verification','health','diagnosis')"
KINDS_BEFORE = "kind IN ('identification','uncertainty','verification','health')"


def upgrade() -> None:
    _replace_kinds(KINDS)
    op.create_table(
        "result_file",
        sa.Column("result", sa.Integer(), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("content", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(["result"], ["result.id"], name=op.f("fk_result_file_result")),
        sa.PrimaryKeyConstraint("result", "name", name=op.f("pk_result_file")),
    )
    with op.batch_alter_table("job", schema=None) as batch_op:
        batch_op.add_column(sa.Column("request", sa.JSON(), nullable=True))
    with op.batch_alter_table("campaign", schema=None) as batch_op:
        batch_op.add_column(sa.Column("follows", sa.Integer(), nullable=True))
        batch_op.add_column(sa.Column("rounds", sa.Integer(), nullable=False, server_default="1"))
        batch_op.create_foreign_key(op.f("fk_campaign_follows"), "campaign", ["follows"], ["id"])


def downgrade() -> None:
    with op.batch_alter_table("campaign", schema=None) as batch_op:
        batch_op.drop_constraint(op.f("fk_campaign_follows"), type_="foreignkey")
        batch_op.drop_column("rounds")
        batch_op.drop_column("follows")
    op.execute("DELETE FROM job WHERE kind IN ('diagnose','repeat')")
    with op.batch_alter_table("job", schema=None) as batch_op:
        batch_op.drop_column("request")
    op.drop_table("result_file")
    op.execute("DELETE FROM result WHERE kind = 'diagnosis'")
    _replace_kinds(KINDS_BEFORE)


def _replace_kinds(condition: str) -> None:
    with op.batch_alter_table("result", schema=None) as batch_op:
        batch_op.drop_constraint(op.f("ck_result_kind"), type_="check")
        batch_op.create_check_constraint(op.f("ck_result_kind"), sa.text(condition))

"""Where a campaign's robot is on its way."""

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "whereabouts",
        sa.Column("campaign", sa.Integer(), nullable=False),
        sa.Column("joints", sa.JSON(), nullable=False),
        sa.ForeignKeyConstraint(
            ["campaign"], ["campaign.id"], name=op.f("fk_whereabouts_campaign")
        ),
        sa.PrimaryKeyConstraint("campaign", name=op.f("pk_whereabouts")),
    )


def downgrade() -> None:
    op.drop_table("whereabouts")

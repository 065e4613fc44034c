"""The sides from which a diagnosis asks each joint to come into a pose."""

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    with op.batch_alter_table("pose", schema=None) as batch_op:
        batch_op.add_column(sa.Column("sides", sa.JSON(), nullable=True))


def downgrade() -> None:
    with op.batch_alter_table("pose", schema=None) as batch_op:
        batch_op.drop_column("sides")

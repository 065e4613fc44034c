"""Several hosts: Procrastinate's tables on PostgreSQL, immutable readings there, live workers."""

import sqlalchemy as sa
from alembic import op
from procrastinate.schema import SchemaManager

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

QUEUE_SCHEMA = "procrastinate"


def upgrade() -> None:
    op.create_table(
        "worker",
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("heard", sa.Double(), nullable=False),
        sa.PrimaryKeyConstraint("name", name=op.f("pk_worker")),
    )
    with op.batch_alter_table("job") as batch:
        batch.add_column(sa.Column("delivery", sa.Integer(), nullable=True))
    if op.get_bind().dialect.name == "postgresql":
        _make_queue()
        _protect_readings()


def _make_queue() -> None:
    connection = op.get_bind()
    connection.exec_driver_sql(f"CREATE SCHEMA {QUEUE_SCHEMA}")
    connection.exec_driver_sql(f"SET LOCAL search_path TO {QUEUE_SCHEMA}")
    # The driver takes a percent sign for a parameter's place only where parameters are given.
    driver = connection.connection.driver_connection
    assert driver is not None
    driver.execute(SchemaManager.get_schema())
    connection.exec_driver_sql(f"SET LOCAL search_path TO public, {QUEUE_SCHEMA}")


def _protect_readings() -> None:
    op.execute(
        "CREATE FUNCTION reading_is_never_changed() RETURNS trigger LANGUAGE plpgsql AS "
        "$$ BEGIN RAISE EXCEPTION 'a reading is never changed'; END $$"
    )
    op.execute(
        "CREATE TRIGGER reading_no_change BEFORE UPDATE OR DELETE ON reading "
        "FOR EACH ROW EXECUTE FUNCTION reading_is_never_changed()"
    )


def downgrade() -> None:
    if op.get_bind().dialect.name == "postgresql":
        op.execute("DROP TRIGGER reading_no_change ON reading")
        op.execute("DROP FUNCTION reading_is_never_changed()")
        op.execute(f"DROP SCHEMA {QUEUE_SCHEMA} CASCADE")
    with op.batch_alter_table("job") as batch:
        batch.drop_column("delivery")
    op.drop_table("worker")

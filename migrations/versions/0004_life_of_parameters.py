"""Life of parameters: verified, a history of who did what when, criteria of verifications."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

STATES = "state IN ('candidate','verified','released','superseded')"
STATES_BEFORE = "state IN ('candidate','released','superseded')"
KINDS = "kind IN ('identification','uncertainty','verification','health')"
KINDS_BEFORE = "kind IN ('identification','uncertainty','verification')"


def upgrade() -> None:
    _replace_check("parameters", "ck_parameters_state", STATES)
    _replace_check("result", "ck_result_kind", KINDS)
    with op.batch_alter_table("campaign", schema=None) as batch_op:
        batch_op.add_column(sa.Column("criterion", sa.JSON(), nullable=True))
    op.create_table(
        "parameters_event",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("cell", sa.Text(), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("event", sa.Text(), nullable=False),
        sa.Column("person", sa.Text(), nullable=True),
        sa.Column("reason", sa.Text(), nullable=False),
        sa.Column("campaign", sa.Integer(), nullable=True),
        sa.Column("origin", sa.JSON(), nullable=False),
        sa.Column("at", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(
            ["cell", "version"],
            ["parameters.cell", "parameters.version"],
            name=op.f("fk_parameters_event_cell_version"),
        ),
        sa.ForeignKeyConstraint(
            ["campaign"], ["campaign.id"], name=op.f("fk_parameters_event_campaign")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_parameters_event")),
    )
    with op.batch_alter_table("parameters_event", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_parameters_event_cell"), ["cell"], unique=False)
    _protect_history()


def _protect_history() -> None:
    sentence = "the history of parameters is never changed"
    if op.get_bind().dialect.name == "sqlite":
        for change in ("UPDATE", "DELETE"):
            op.execute(
                f"CREATE TRIGGER parameters_event_no_{change.lower()} BEFORE {change} "
                f"ON parameters_event BEGIN SELECT RAISE(ABORT, '{sentence}'); END"
            )
    else:
        op.execute(
            "CREATE FUNCTION parameters_event_is_never_changed() RETURNS trigger "
            f"LANGUAGE plpgsql AS $$ BEGIN RAISE EXCEPTION '{sentence}'; END $$"
        )
        op.execute(
            "CREATE TRIGGER parameters_event_no_change BEFORE UPDATE OR DELETE ON "
            "parameters_event FOR EACH ROW EXECUTE FUNCTION parameters_event_is_never_changed()"
        )


def downgrade() -> None:
    op.drop_table("parameters_event")
    if op.get_bind().dialect.name == "postgresql":
        op.execute("DROP FUNCTION parameters_event_is_never_changed()")
    with op.batch_alter_table("campaign", schema=None) as batch_op:
        batch_op.drop_column("criterion")
    op.execute("DELETE FROM result WHERE kind = 'health'")
    _replace_check("result", "ck_result_kind", KINDS_BEFORE)
    op.execute("UPDATE parameters SET state = 'candidate' WHERE state = 'verified'")
    _replace_check("parameters", "ck_parameters_state", STATES_BEFORE)


def _replace_check(table: str, name: str, condition: str) -> None:
    with op.batch_alter_table(table, schema=None) as batch_op:
        batch_op.drop_constraint(op.f(name), type_="check")
        batch_op.create_check_constraint(op.f(name), sa.text(condition))

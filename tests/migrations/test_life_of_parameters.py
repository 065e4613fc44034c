"""Parameters that were there before the life of parameters keep their state, up and down."""

import sqlite3
from contextlib import closing

import pytest
from alembic import command

from service.db.engine import open_database
from service.db.upgrade import alembic_config

BEFORE, LIFE = "0003", "0004"
ROWS = """
INSERT INTO cell VALUES ('c', '{}', 0, 'now');
INSERT INTO campaign (id, cell, kind, state, wish, reason, revision, pose_count, repeats, settle_s,
  seed, robot_yaml, joint_units, created)
  VALUES (1, 'c', 'calibrate', 'finished', '', '', 1, 1, 1, 0, 1, '', '[]', 'now');
INSERT INTO result VALUES (1, 1, 'identification', '{}', NULL, 'ab', '0', '{}', 'now');
INSERT INTO parameters VALUES ('c', 1, 'superseded', '{}', 1, 'now', 'then');
INSERT INTO parameters VALUES ('c', 2, 'released', '{}', 1, 'now', 'then');
INSERT INTO parameters VALUES ('c', 3, 'candidate', '{}', 1, 'now', NULL);
"""


@pytest.fixture
def file(tmp_path):
    return tmp_path / "migrated.sqlite3"


@pytest.fixture
def config(file):
    database = open_database(f"sqlite:///{file}")
    yield alembic_config(database.engine)
    database.close()


def ask(file, query: str) -> list[tuple]:
    with closing(sqlite3.connect(file)) as connection, connection:
        return connection.execute(query).fetchall()


def test_old_versions_keep_their_states_and_a_verified_one_falls_back_to_candidate(config, file):
    command.upgrade(config, BEFORE)
    with closing(sqlite3.connect(file)) as connection:
        connection.executescript(ROWS)
    command.upgrade(config, LIFE)
    states = "SELECT state FROM parameters ORDER BY version"
    assert ask(file, states) == [("superseded",), ("released",), ("candidate",)]
    ask(file, "UPDATE parameters SET state = 'verified' WHERE version = 3")
    with pytest.raises(sqlite3.IntegrityError, match="UNIQUE"):
        ask(file, "UPDATE parameters SET state = 'released' WHERE version = 1")
    with pytest.raises(sqlite3.IntegrityError, match="CHECK"):
        ask(file, "UPDATE parameters SET state = 'secret' WHERE version = 1")
    command.downgrade(config, BEFORE)
    assert ask(file, states) == [("superseded",), ("released",), ("candidate",)]
    assert ask(file, "SELECT count(*) FROM result") == [(1,)]

"""The journal's tables, and how an older journal becomes one of today.

One table holds everything: records are only ever added. Triggers refuse whatever would change or remove one,
so that neither a slip in this program nor a tool at the command line rewrites a game without noticing.
"""

import sqlite3
from pathlib import Path

from kempelen.core.errors import JournalError

APPLICATION_ID = 0x4B504C4E  # "KPLN", in the file's header: this SQLite file is a journal

_VERSION_1 = """
CREATE TABLE records (
    seq  INTEGER PRIMARY KEY,
    game INTEGER NOT NULL CHECK (game > 0),
    at   TEXT NOT NULL,
    kind TEXT NOT NULL,
    body TEXT NOT NULL CHECK (json_valid(body))
) STRICT;
CREATE INDEX records_of_game ON records (game, seq);
CREATE UNIQUE INDEX one_beginning ON records (game) WHERE kind = 'begun';
CREATE UNIQUE INDEX one_end ON records (game) WHERE kind = 'ended';
CREATE TRIGGER never_updated BEFORE UPDATE ON records
    BEGIN SELECT RAISE(ABORT, 'the journal is append-only: a record cannot be changed'); END;
CREATE TRIGGER never_deleted BEFORE DELETE ON records
    BEGIN SELECT RAISE(ABORT, 'the journal is append-only: a record cannot be deleted'); END;
CREATE TRIGGER never_replaced BEFORE INSERT ON records
    WHEN EXISTS (SELECT 1 FROM records WHERE seq = NEW.seq)
    BEGIN SELECT RAISE(ABORT, 'the journal is append-only: a record cannot be replaced'); END;
"""

MIGRATIONS: tuple[str, ...] = (_VERSION_1,)
"""Script ``n`` makes version n + 1 of version n; a new file has version 0."""


def version_of(connection: sqlite3.Connection) -> int:
    """The schema version that the file says it has."""
    return int(connection.execute("PRAGMA user_version").fetchone()[0])


def check_identity(connection: sqlite3.Connection, path: Path) -> int:
    """Make sure that the file is a journal that this program can read; its version.

    Raises:
        JournalError: It belongs to another program, or to a newer version of this one.
    """
    tables = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
    if tables and connection.execute("PRAGMA application_id").fetchone()[0] != APPLICATION_ID:
        raise JournalError(
            f"{path} is an SQLite file, but no journal of games.",
            hint="Name another data directory with --data-dir.",
        )
    version = version_of(connection)
    if version > len(MIGRATIONS):
        raise JournalError(
            f"The journal {path} has schema version {version}; this program reads up to {len(MIGRATIONS)}.",
            hint="It was written by a newer version of the program: update, or name another --data-dir.",
        )
    return version


def migrate(connection: sqlite3.Connection, path: Path) -> None:
    """Bring a journal to today's schema, each version in one transaction, after a copy of the old file."""
    version = check_identity(connection, path)
    if 0 < version < len(MIGRATIONS):
        _keep_copy(connection, path.with_name(f"{path.name}.v{version}"))
    for number in range(version, len(MIGRATIONS)):
        connection.executescript(
            f"BEGIN IMMEDIATE; PRAGMA application_id = {APPLICATION_ID};"
            f"{MIGRATIONS[number]} PRAGMA user_version = {number + 1}; COMMIT;"
        )


def _keep_copy(connection: sqlite3.Connection, path: Path) -> None:
    copy = sqlite3.connect(path)
    try:
        connection.backup(copy)
    finally:
        copy.close()

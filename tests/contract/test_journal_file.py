"""The journal as a file: durable, append-only, one writer, versioned, and honest about damage."""

import itertools
import os
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import chess
import pytest

from kempelen.core.errors import JournalError
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.protocols import Checkpoint
from kempelen.core.table import Table, start_layout
from kempelen.game import schema
from kempelen.game.journal import FILE_NAME, GameLog, Journal, JournalReader
from kempelen.game.records import (
    Begun,
    Committed,
    Ended,
    Intended,
    ModeSwapped,
    PairingSpec,
    Paused,
    PlayerSpec,
    Purpose,
    Record,
    Step,
)

E4 = (Transfer(chess.Piece.from_symbol("P"), Place("e2"), Place("e4")),)
EXIT_HELD = 9


def spec(kind: str, name: str) -> PlayerSpec:
    return PlayerSpec(kind=kind, name=name, details={"level": 3})


PAIRING = PairingSpec(mode="play", white=spec("person", "Anna"), black=spec("engine", "Stockfish"))
BEGUN = Begun(headers={"Event": "Test"}, pairing=PAIRING, layout=start_layout(Table(), chess.Board()))


def move_of(uci: str, ply: int, transfers: tuple[Transfer, ...]) -> list[Record]:
    board = chess.Board()
    steps = [
        Step(index=index, checkpoint=checkpoint)
        for index in range(len(transfers))
        for checkpoint in Checkpoint
    ]
    return [
        Intended(purpose=Purpose.MOVE, ply=ply, uci=uci, transfers=transfers),
        *steps,
        Committed(purpose=Purpose.MOVE, ply=ply, uci=uci, san=board.san(chess.Move.from_uci(uci))),
    ]


def write_all(log: GameLog, records: list[Record]) -> None:
    for record in records:
        log.write(record)


def ticking() -> Iterator[datetime]:
    """A clock that is read once a second."""
    start = datetime(2026, 3, 1, 12, 0, tzinfo=UTC)
    return (start + timedelta(seconds=second) for second in itertools.count())


@pytest.fixture
def journal(tmp_path: Path) -> Iterator[Journal]:
    with Journal(tmp_path) as journal:
        yield journal


def raw(path: Path) -> sqlite3.Connection:
    return sqlite3.connect(path / FILE_NAME)


# --- durable ------------------------------------------------------------------------------------------------


def test_settings_make_every_write_durable(journal: Journal) -> None:
    assert journal._connection.execute("PRAGMA journal_mode").fetchone()[0] == "wal"
    assert journal._connection.execute("PRAGMA synchronous").fetchone()[0] == 2  # FULL


CHILD = """
import sys, time
from pathlib import Path
sys.path.insert(0, sys.argv[2])
from test_journal_file import BEGUN, E4, move_of
from kempelen.game.journal import Journal
journal = Journal(Path(sys.argv[1]))
log = journal.begin(BEGUN)
for record in move_of("e2e4", 1, E4)[:3]:
    log.write(record)
print("written", flush=True)
time.sleep(60)
"""


@pytest.fixture
def other_program(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """Another process that has written a move up to CARRYING, and holds the journal."""
    here = str(Path(__file__).parent)
    with subprocess.Popen(
        [sys.executable, "-c", CHILD, str(tmp_path), here], stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "written\n"
        yield child
        child.kill()


def test_a_killed_writer_loses_nothing_and_leaves_no_lock(
    tmp_path: Path, other_program: subprocess.Popen[str]
) -> None:
    other_program.send_signal(signal.SIGKILL)
    assert other_program.wait() == -signal.SIGKILL
    with Journal(tmp_path) as journal:
        log = journal.reopen(1)
        assert log.resumed
        pending = log.state.pending
        assert pending is not None
        assert pending.at_hand == E4[0]
        assert pending.carrying


def test_a_second_program_is_told_who_has_the_journal(
    tmp_path: Path, other_program: subprocess.Popen[str]
) -> None:
    with pytest.raises(JournalError, match=f"in use by process {other_program.pid} ") as caught:
        Journal(tmp_path)
    assert "--data-dir" in caught.value.hint
    with JournalReader(tmp_path) as reader:  # reading is allowed meanwhile
        assert [summary.game for summary in reader.games()] == [1]


def test_the_lock_ends_with_the_journal(tmp_path: Path) -> None:
    Journal(tmp_path).close()
    with Journal(tmp_path), pytest.raises(JournalError, match=str(os.getpid())):
        Journal(tmp_path)
    Journal(tmp_path).close()


# --- append-only --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("statement", "why"),
    [
        ("UPDATE records SET body = '{}'", "cannot be changed"),
        ("DELETE FROM records", "cannot be deleted"),
        ("INSERT OR REPLACE INTO records VALUES (1, 1, '', 'begun', '{}')", "cannot be replaced"),
        ("INSERT INTO records VALUES (NULL, 2, '', 'begun', 'not json')", "CHECK"),
        ("INSERT INTO records VALUES (NULL, 1, '', 'begun', '{}')", "UNIQUE"),
    ],
)
def test_nothing_written_can_be_changed(tmp_path: Path, statement: str, why: str) -> None:
    with Journal(tmp_path) as journal:
        journal.begin(BEGUN)
    connection = raw(tmp_path)
    with pytest.raises(sqlite3.IntegrityError, match=why):
        connection.execute(statement)
    connection.close()
    with JournalReader(tmp_path) as reader:
        assert len(list(reader.records(1))) == 1


def test_a_record_that_cannot_follow_is_not_written(journal: Journal) -> None:
    log = journal.begin(BEGUN)
    with pytest.raises(JournalError, match="no"):
        log.write(Step(index=0, checkpoint=Checkpoint.GRIPPING))
    assert len(list(journal.records(1))) == 1
    log.write(Paused())
    assert log.state.paused


# --- reading ------------------------------------------------------------------------------------------------


def test_games_are_listed_newest_first(tmp_path: Path) -> None:
    clock = ticking()
    with Journal(tmp_path, now=lambda: next(clock)) as journal:
        first = journal.begin(BEGUN)
        write_all(first, move_of("e2e4", 1, E4))
        first.write(Ended(result="1-0", reason="Black resigns"))
        second = journal.begin(BEGUN)
        swapped = PAIRING.model_copy(update={"mode": "watch", "white": spec("engine", "Maia")})
        second.write(ModeSwapped(pairing=swapped))
        games = journal.games()
    assert [game.game for game in games] == [2, 1]
    newest, oldest = games
    assert (newest.mode, newest.white, newest.black, newest.over) == ("watch", "Maia", "Stockfish", False)
    assert (oldest.plies, oldest.result, oldest.reason, oldest.over) == (1, "1-0", "Black resigns", True)
    assert oldest.started == "2026-03-01T12:00:00.000+00:00"
    assert oldest.last == "2026-03-01T12:00:06.000+00:00"


def test_takebacks_count_backwards(journal: Journal) -> None:
    log = journal.begin(BEGUN)
    write_all(log, move_of("e2e4", 1, E4))
    back = (Transfer(E4[0].piece, E4[0].target, E4[0].source),)
    log.write(Intended(purpose=Purpose.TAKEBACK, ply=1, uci="e2e4", transfers=back))
    for checkpoint in Checkpoint:
        log.write(Step(index=0, checkpoint=checkpoint))
    log.write(Committed(purpose=Purpose.TAKEBACK, ply=1, uci="e2e4", san="e4"))
    assert journal.games()[0].plies == 0
    assert log.state.board == chess.Board()
    assert log.state.layout == BEGUN.layout


def test_latest_game(journal: Journal) -> None:
    with pytest.raises(JournalError, match="holds no game"):
        journal.latest()
    journal.begin(BEGUN)
    journal.begin(BEGUN).write(Ended(result="*", reason="score ends"))
    assert journal.latest() == 2
    assert journal.latest(unfinished=True) == 1
    journal.reopen(1).write(Ended(result="*", reason="score ends"))
    with pytest.raises(JournalError, match="no unfinished game"):
        journal.latest(unfinished=True)


def test_a_finished_game_is_not_reopened(journal: Journal) -> None:
    journal.begin(BEGUN).write(Ended(result="0-1", reason="White resigns"))
    with pytest.raises(JournalError, match="over: 0-1, White resigns") as caught:
        journal.reopen(1)
    assert "kempelen pgn 1" in caught.value.hint


def test_an_unknown_game(journal: Journal) -> None:
    with pytest.raises(JournalError, match="no game 7; it is empty"):
        journal.state(7)
    journal.begin(BEGUN)
    with pytest.raises(JournalError, match="no game 7; it has 1 to 1"):
        journal.reopen(7)


def test_the_whole_state_comes_back(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        log = journal.begin(BEGUN)
        write_all(log, move_of("e2e4", 1, E4))
        believed = log.state
    with JournalReader(tmp_path / FILE_NAME) as reader:
        state = reader.state(1)
    assert state.layout == believed.layout == BEGUN.layout.after(E4[0])
    assert state.board.fen() == believed.board.fen()
    assert state.around == E4[0]
    assert state.pairing == PAIRING


def test_no_journal_yet(tmp_path: Path) -> None:
    with pytest.raises(JournalError, match="no journal at") as caught:
        JournalReader(tmp_path)
    assert "kempelen play" in caught.value.hint
    assert list(tmp_path.iterdir()) == []


# --- versions -----------------------------------------------------------------------------------------------


def test_a_newer_version_is_refused(tmp_path: Path) -> None:
    Journal(tmp_path).close()
    connection = raw(tmp_path)
    connection.execute("PRAGMA user_version = 99")
    connection.close()
    for opening in (Journal, JournalReader):
        with pytest.raises(JournalError, match=r"version 99; this program reads up to 1") as caught:
            opening(tmp_path)
        assert "update" in caught.value.hint


def test_an_older_version_is_migrated_after_a_copy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with Journal(tmp_path) as journal:
        journal.begin(BEGUN)
    wider = (*schema.MIGRATIONS, "CREATE TABLE notes (text TEXT) STRICT;")
    monkeypatch.setattr(schema, "MIGRATIONS", wider)
    with Journal(tmp_path) as journal:
        assert journal._connection.execute("PRAGMA user_version").fetchone()[0] == 2
        assert journal.state(1).begun == BEGUN
        journal._connection.execute("INSERT INTO notes VALUES ('new')")
    kept = tmp_path / f"{FILE_NAME}.v1"
    monkeypatch.undo()
    with JournalReader(kept) as old:
        assert old.state(1).begun == BEGUN


def test_a_failed_migration_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with Journal(tmp_path) as journal:
        journal.begin(BEGUN)
    monkeypatch.setattr(schema, "MIGRATIONS", (*schema.MIGRATIONS, "CREATE TABLE half (x); NONSENSE;"))
    with pytest.raises(JournalError, match="NONSENSE"):
        Journal(tmp_path)
    monkeypatch.undo()
    with Journal(tmp_path) as journal:
        assert journal.state(1).begun == BEGUN


# --- bad files ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "content", [b"hello, I am no database at all " * 20, b"SQLite format 3\0" + bytes(300)]
)
def test_not_a_database(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / FILE_NAME
    path.write_bytes(content)
    for _ in "twice":
        with pytest.raises(JournalError, match="damaged") as caught:
            Journal(tmp_path)
    copies = list(tmp_path.glob("journal.damaged-*.sqlite3"))
    assert len(copies) == 1
    assert copies[0].read_bytes() == content
    assert str(copies[0]) in str(caught.value)
    assert path.read_bytes() == content


def test_a_damaged_page_is_noticed_and_nothing_is_lost(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        for _ in range(30):
            journal.begin(BEGUN)
    path = tmp_path / FILE_NAME
    content = bytearray(path.read_bytes())
    content[2 * 4096 : 3 * 4096] = os.urandom(4096)
    path.write_bytes(content)
    with pytest.raises(JournalError, match="damaged") as caught:
        Journal(tmp_path)
    assert "recover" in caught.value.hint
    assert path.read_bytes() == content
    assert next(tmp_path.glob("journal.damaged-*")).read_bytes() == content


def test_another_programs_database_is_left_alone(tmp_path: Path) -> None:
    connection = raw(tmp_path)
    connection.execute("CREATE TABLE recipes (name)")
    connection.close()
    for opening in (Journal, JournalReader):
        with pytest.raises(JournalError, match="no journal of games"):
            opening(tmp_path)
    connection = raw(tmp_path)
    assert connection.execute("SELECT name FROM sqlite_master").fetchall() == [("recipes",)]
    connection.close()


def test_an_unreadable_record_is_named(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        journal.begin(BEGUN)
    connection = raw(tmp_path)
    connection.execute("INSERT INTO records VALUES (NULL, 1, '', 'step', '{\"kind\": \"waltz\"}')")
    connection.commit()
    connection.close()
    with JournalReader(tmp_path) as reader, pytest.raises(JournalError, match=r"record 2.*waltz"):
        reader.state(1)


def test_a_game_without_beginning_is_damage(tmp_path: Path) -> None:
    Journal(tmp_path).close()
    connection = raw(tmp_path)
    connection.execute("INSERT INTO records VALUES (NULL, 4, '', 'paused', '{\"kind\": \"paused\"}')")
    connection.commit()
    connection.close()
    with JournalReader(tmp_path) as reader:
        assert [(game.game, game.over, game.reason) for game in reader.games()] == [(4, True, "damaged")]
        with pytest.raises(JournalError, match="Game 4 .* does not start with its beginning"):
            reader.state(4)


def test_a_place_that_cannot_be_written(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    with pytest.raises(JournalError, match="cannot be used") as caught:
        Journal(blocked / "deeper")
    assert "--data-dir" in caught.value.hint


def test_a_full_disk_is_told_and_the_record_is_not_believed(journal: Journal) -> None:
    log = journal.begin(BEGUN)
    pages = journal._connection.execute("PRAGMA page_count").fetchone()[0]
    journal._connection.execute(f"PRAGMA max_page_count = {pages}")
    with pytest.raises(JournalError, match="full") as caught:
        write_all(log, [ModeSwapped(pairing=PAIRING)] * 200)
    assert "free space" in caught.value.hint
    assert len(list(journal.records(1))) > 1
    journal._connection.execute("PRAGMA max_page_count = 1000000")
    log.write(Paused())
    assert log.state.paused


def test_layouts_and_transfers_survive_as_text(journal: Journal) -> None:
    layout = Layout(
        {Place("left16"): chess.Piece.from_symbol("n"), Place("e1"): chess.Piece.from_symbol("K")}
    )
    journal.begin(BEGUN.model_copy(update={"layout": layout}))
    assert journal.state(1).layout == layout

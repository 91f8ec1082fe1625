"""The durable record of all games: one SQLite file, one writer, nothing ever changed.

Every write is on disk when `GameLog.write` returns (write-ahead log, ``synchronous=FULL``): a few tenths of a
millisecond on a solid-state disk, so that it is done in the event loop, in order, where no cancellation can
fall between a record and the state that follows from it.
"""

import contextlib
import hashlib
import shutil
import sqlite3
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Self
from urllib.parse import quote

from kempelen.core.errors import JournalError
from kempelen.game.journal_lock import WriterLock
from kempelen.game.records import Begun, Ended, PairingSpec, PlayerSpec, Record, from_json, to_json
from kempelen.game.schema import check_identity, migrate
from kempelen.game.state import GameState

FILE_NAME = "journal.sqlite3"


def _utc_now() -> datetime:
    return datetime.now(UTC)


_NOBODY = PlayerSpec(kind="unknown", name="?")
_UNKNOWN = PairingSpec(mode="?", white=_NOBODY, black=_NOBODY)


@dataclass(frozen=True, slots=True)
class GameSummary:
    """A line in the list of games.

    Attributes:
        plies: Half-moves in the game.
        result: ``*`` while it is not over.
        reason: Of its end; empty while it is not over; "damaged" when its records cannot be read.
    """

    game: int
    started: str
    last: str
    mode: str
    white: str
    black: str
    plies: int
    result: str
    reason: str

    @property
    def over(self) -> bool:
        """Whether it has ended, so that it cannot be resumed."""
        return bool(self.reason)


class JournalReader:
    """Read access to a journal, also while another process writes to it.

    Args:
        path: Of the file, or of the directory that holds `FILE_NAME`.

    Raises:
        JournalError: No such file, no journal, damaged, or of a newer version.
    """

    def __init__(self, path: Path) -> None:
        self.path = _file(path)
        with _explained(self.path):
            self._connection = self._connect()

    def _connect(self) -> sqlite3.Connection:
        if not self.path.is_file():
            raise JournalError(
                f"There is no journal at {self.path}.", hint="Play a game first: kempelen play"
            )
        connection = sqlite3.connect(f"file:{quote(str(self.path))}?mode=ro", uri=True, isolation_level=None)
        with _closing_on_error(connection):
            check_identity(connection, self.path)
        return connection

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the file."""
        self._connection.close()

    def games(self) -> list[GameSummary]:
        """All games, the newest first."""
        with _explained(self.path):
            rows = self._connection.execute(
                "SELECT game, min(at), max(at), sum(CASE WHEN kind <> 'committed' THEN 0 "
                "WHEN json_extract(body, '$.purpose') = 'move' THEN 1 ELSE -1 END), "
                "max(CASE WHEN kind IN ('begun', 'mode-swapped') THEN seq END), "
                "max(CASE WHEN kind = 'ended' THEN seq END) FROM records GROUP BY game ORDER BY game DESC"
            ).fetchall()
            return [self._summary(row) for row in rows]

    def _summary(self, row: tuple[int, str, str, int, int | None, int | None]) -> GameSummary:
        game, started, last, plies, pairing_seq, end_seq = row
        try:
            pairing = getattr(self._record(pairing_seq), "pairing", _UNKNOWN)
            end = self._record(end_seq) if end_seq else None
        except JournalError:
            pairing, end = _UNKNOWN, Ended(result="*", reason="damaged")
        result, reason = (end.result, end.reason) if isinstance(end, Ended) else ("*", "")
        names = (pairing.mode, pairing.white.name, pairing.black.name)
        return GameSummary(game, started, last, *names, plies, result, reason)

    def _record(self, seq: int | None) -> Record:
        row = self._connection.execute("SELECT body FROM records WHERE seq = ?", (seq,)).fetchone()
        return from_json(row[0] if row else "")

    def records(self, game: int) -> Iterator[tuple[str, Record]]:
        """(UTC time, record) of one game, in order.

        Raises:
            JournalError: A record is damaged.
        """
        with _explained(self.path):
            rows = self._connection.execute(
                "SELECT seq, at, body FROM records WHERE game = ? ORDER BY seq", (game,)
            ).fetchall()
        for seq, at, body in rows:
            with _at_record(self.path, seq):
                record = from_json(body)
            yield at, record

    def state(self, game: int) -> GameState:
        """Rebuild a game: position, layout, the move in hand and how far it has come.

        Raises:
            JournalError: No such game, or a record is damaged or does not fit.
        """
        records = (record for _, record in self.records(game))
        first = next(records, None)
        if first is None:
            raise self._no_game(game)
        if not isinstance(first, Begun):
            raise JournalError(f"Game {game} in {self.path} does not start with its beginning.")
        state = GameState.begin(first)
        for record in records:
            state = state.after(record)
        return state

    def latest(self, *, unfinished: bool = False) -> int:
        """Number of the newest game, or of the newest one that is not over.

        Raises:
            JournalError: There is none.
        """
        for summary in self.games():
            if not (unfinished and summary.over):
                return summary.game
        raise JournalError(
            f"The journal {self.path} holds no {'unfinished ' if unfinished else ''}game.",
            hint="Begin one: kempelen play",
        )

    def _no_game(self, game: int) -> JournalError:
        numbers = [summary.game for summary in self.games()]
        known = f"it has {min(numbers)} to {max(numbers)}" if numbers else "it is empty"
        return JournalError(
            f"The journal {self.path} has no game {game}; {known}.", hint="See: kempelen games"
        )


class Journal(JournalReader):
    """The one writer. Close it, or use it as a context manager.

    Args:
        path: Of the file, or of a directory; made when it is not there.
        now: The clock.

    Raises:
        JournalError: In use by another process, damaged (a copy is kept), of a newer version, not writable.
    """

    def __init__(self, path: Path, *, now: Callable[[], datetime] = _utc_now) -> None:
        self.now = now
        try:
            _file(path).parent.mkdir(parents=True, exist_ok=True)
            self._lock = WriterLock(_file(path))
        except OSError as error:
            raise _unusable(_file(path), error.strerror or str(error)) from error
        try:
            super().__init__(path)
        except BaseException:
            self._lock.release()
            raise

    def _connect(self) -> sqlite3.Connection:
        connection = sqlite3.connect(self.path, isolation_level=None)
        with _closing_on_error(connection):
            connection.execute("PRAGMA journal_mode = WAL")
            connection.execute("PRAGMA synchronous = FULL")
            connection.execute("PRAGMA fullfsync = ON")
            fault = connection.execute("PRAGMA quick_check(1)").fetchone()[0]
            if fault != "ok":
                raise sqlite3.DatabaseError(fault)
            migrate(connection, self.path)
        return connection

    def close(self) -> None:
        """Let go of the file and of the lock."""
        super().close()
        self._lock.release()

    def append(self, game: int, record: Record) -> None:
        """Put a record on disk; it is there when this returns.

        Raises:
            JournalError: It could not be written: no space, no permission, damaged.
        """
        at = self.now().isoformat(timespec="milliseconds")
        with _explained(self.path):
            self._connection.execute(
                "INSERT INTO records (game, at, kind, body) VALUES (?, ?, ?, ?)",
                (game, at, record.kind, to_json(record)),
            )

    @property
    def next_game(self) -> int:
        """Number that the next new game gets."""
        with _explained(self.path):
            last = self._connection.execute("SELECT max(game) FROM records").fetchone()[0]
        return int(last or 0) + 1

    def begin(self, begun: Begun) -> "GameLog":
        """A new game."""
        state = GameState.begin(begun)
        game = self.next_game
        self.append(game, begun)
        return GameLog(self, game, state)

    def reopen(self, game: int) -> "GameLog":
        """A game to go on with.

        Raises:
            JournalError: No such game, it is over, or a record is damaged.
        """
        state = self.state(game)
        if state.ended is not None:
            raise JournalError(
                f"Game {game} is over: {state.ended.result}, {state.ended.reason}.",
                hint=f"Export it: kempelen pgn {game}",
            )
        return GameLog(self, game, state, resumed=True)


class GameLog:
    """One game in the journal, and the state that its records give.

    Attributes:
        game: Its number.
        state: After the last record.
        resumed: Whether another program, or another arbiter, began it.
    """

    def __init__(self, journal: Journal, game: int, state: GameState, *, resumed: bool = False) -> None:
        self.resumed = resumed
        self.journal = journal
        self.game = game
        self.state = state

    def write(self, record: Record) -> None:
        """Put a record on disk, then move the state on.

        Raises:
            JournalError: The record cannot follow (nothing is written), or it could not be written.
        """
        state = self.state.after(record)
        self.journal.append(self.game, record)
        self.state = state


def _file(path: Path) -> Path:
    return path / FILE_NAME if path.is_dir() or not path.suffix else path


@contextlib.contextmanager
def _closing_on_error(connection: sqlite3.Connection) -> Iterator[None]:
    try:
        yield
    except BaseException:
        connection.close()
        raise


@contextlib.contextmanager
def _at_record(path: Path, seq: int) -> Iterator[None]:
    try:
        yield
    except JournalError as error:
        raise JournalError(f"{path}, record {seq}: {error.message}", hint=error.hint) from error


@contextlib.contextmanager
def _explained(path: Path) -> Iterator[None]:
    """Turn SQLite's errors into ours; a damaged file is copied before anything else happens to it."""
    try:
        yield
    except (sqlite3.OperationalError, sqlite3.IntegrityError) as error:
        raise _unusable(path, str(error)) from error
    except sqlite3.DatabaseError as error:
        raise JournalError(
            f"The journal {path} is damaged: {error}. A copy is kept as {_keep_damaged(path)}.",
            hint=f"Move {path} away to begin a new one; recover the games with: sqlite3 COPY .recover",
        ) from error


def _unusable(path: Path, why: str) -> JournalError:
    return JournalError(
        f"The journal {path} cannot be used: {why}.",
        hint="Check the disk's free space and the permissions, or name another --data-dir.",
    )


def _keep_damaged(path: Path) -> Path:
    """Copy the file and its write-ahead log; the copy is named by its content, so that one is enough."""
    digest = hashlib.sha256(path.read_bytes()).hexdigest()[:8]
    copy = path.with_name(f"{path.stem}.damaged-{digest}{path.suffix}")
    for end in ("", "-wal"):
        source = Path(f"{path}{end}")
        if source.is_file() and not Path(f"{copy}{end}").exists():
            shutil.copy2(source, f"{copy}{end}")
    return copy

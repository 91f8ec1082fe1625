"""From the options of a game command to the game that is run."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import chess

from kempelen.app.cast import EngineWish, GameRequest
from kempelen.app.config import NODE_PORT, Config, load_config
from kempelen.app.paths import newest_unfinished
from kempelen.app.standing import setup_request
from kempelen.cli.run import run_game
from kempelen.cli.showing import Showing, require_directory
from kempelen.core.errors import ConfigError
from kempelen.game.clock import TimeControl
from kempelen.game.fen import parse_fen
from kempelen.game.modes import Mode
from kempelen.game.pgn import GameScore, read_game

_OPTIONS: Mapping[str, str] = {
    "engine.path": "--engine",
    "engine.level": "--level",
    "engine.move_time": "--move-time",
    "engine.book": "--book",
    "engine.ponder": "--ponder",
    "robot.kind": "--robot",
    "robot.port": "--port",
    "planner.name": "--planner",
    "twin.speed": "--speed",
    "twin.seed": "--seed",
    "twin.control": "--twin-control",
    "camera.source": "--camera",
    "sensor.kind": "--sensor",
    "data.dir": "--data-dir",
}


def configured(config: Path | None, **overrides: Any) -> Config:
    """The configuration with the options that were given; dots are written as double underscores."""
    speed = overrides.get("twin__speed")
    if speed is not None and speed != "max":
        overrides["twin__speed"] = _number(speed)
    for key, value in overrides.items():
        if isinstance(value, Path):
            overrides[key] = str(value)
    given = {key.replace("__", "."): value for key, value in overrides.items() if value is not None}
    try:
        settings = load_config(config, given)
    except ConfigError as error:
        raise ConfigError(_by_option(error.message, given), hint=error.hint) from None
    if settings.engine.path.startswith(NODE_PORT) and given.get("engine.level"):
        raise ConfigError(
            f"The engine {settings.engine.path} plays at the level of its node.",
            hint="Leave out --level, and give it where the node is: kempelen node engine --level 5",
        )
    require_directory(settings.data_dir)
    return settings


def _by_option(message: str, given: Iterable[str]) -> str:
    """What the configuration says of a key, said of the option that it was given by."""
    for key in given:
        if key in _OPTIONS:
            message = message.replace(f"'{key}' is ", f"{_OPTIONS[key]} is ")
    return message


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def _position(fen: str | None) -> str:
    return parse_fen(fen).fen() if fen is not None else chess.STARTING_FEN


def time_control(text: str | None) -> TimeControl | None:
    """``"5+3"``: five minutes for the game, three seconds more for each move; ``"5"``: without those.

    Raises:
        ConfigError: it is none, or out of range.
    """
    if text is None:
        return None
    minutes, _, seconds = text.partition("+")
    try:
        return TimeControl(60 * float(minutes), float(seconds or 0))
    except ValueError:
        raise ConfigError(
            f"--clock is '{text[:40]}', which is no time control.",
            hint="Give minutes and seconds a move, like 5+3, or minutes alone.",
        ) from None


def play(settings: Config, fen: str | None, clock: str | None, showing: Showing) -> None:
    """A person against the engine."""
    white = settings.play.side == "white"
    control = time_control(clock)
    request = GameRequest(Mode.PLAY, _position(fen), person_plays=white, clock=control)
    run_game(settings, request, showing)


def watch(
    settings: Config,
    fen: str | None,
    clock: str | None,
    opponent: str,
    opponent_level: str,
    showing: Showing,
) -> None:
    """Engine against engine."""
    control = time_control(clock)
    request = GameRequest(
        Mode.WATCH, _position(fen), opponent=opponent, opponent_level=opponent_level, clock=control
    )
    run_game(settings, request, showing)


def replay(
    settings: Config, file: Path, number: int, take_over: int | None, side: str, showing: Showing
) -> None:
    """A recorded game."""
    score = read_game(file, number)
    white = side == "white"
    if take_over is not None:
        _require_move(score, take_over)
    request = GameRequest(
        Mode.REPLAY, score.start_fen, score=score, person_plays=white, take_over_move=take_over
    )
    run_game(settings, request, showing)


def setup(settings: Config, fen: str | None, standing: str, showing: Showing) -> None:
    """The robot sets up a position: a game without moves."""
    run_game(settings, setup_request(settings, _position(fen), standing), showing)


def _require_move(score: GameScore, number: int) -> None:
    """Raises: ConfigError: the score does not come as far as move ``number``."""
    last = score.final_board().fullmove_number
    if not 1 <= number <= last:
        raise ConfigError(
            f"--take-over is {number}, but the moves of this game are numbered up to {last}.",
            hint=f"Give a number from {score.start_board().fullmove_number} to {last}.",
        )


def resume(settings: Config, number: int | None, showing: Showing, wish: EngineWish) -> None:
    """A game of the journal; the newest unfinished one when ``number`` is None."""
    if number is None:
        number = newest_unfinished(settings.data_dir)
    run_game(settings, number, showing, wish)

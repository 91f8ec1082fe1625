"""`kempelen play`, `watch`, `replay` and `resume`."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import chess
import typer

from kempelen.app.cast import GameRequest
from kempelen.app.config import Config, load_config
from kempelen.app.paths import journal_path
from kempelen.cli.options import (
    ConfigOption,
    DataDirOption,
    EngineOption,
    FenOption,
    LevelOption,
    MoveTimeOption,
    PlannerOption,
    PortOption,
    ReportOption,
    RobotOption,
    SeedOption,
    SpeedOption,
)
from kempelen.cli.run import run_game
from kempelen.game.fen import parse_fen
from kempelen.game.journal import JournalReader
from kempelen.game.modes import Mode
from kempelen.game.pgn import read_game


class Side(StrEnum):
    """The person's colour."""

    WHITE = "white"
    BLACK = "black"


class Hands(StrEnum):
    """Who carries the person's pieces."""

    ROBOT = "robot"
    PERSON = "person"


def configured(config: Path | None, **overrides: Any) -> Config:
    """The configuration with the options that were given; dots are written as double underscores."""
    speed = overrides.get("twin__speed")
    if speed is not None and speed != "max":
        overrides["twin__speed"] = _number(speed)
    data = overrides.get("data__dir")
    overrides["data__dir"] = None if data is None else str(data)
    return load_config(config, {key.replace("__", "."): value for key, value in overrides.items()})


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def play(
    side: Annotated[Side | None, typer.Option("--side", help="The person's colour.")] = None,
    hands: Annotated[Hands | None, typer.Option("--hands", help="Who carries the person's pieces.")] = None,
    fen: FenOption = None,
    engine: EngineOption = None,
    level: LevelOption = None,
    move_time: MoveTimeOption = None,
    robot: RobotOption = None,
    port: PortOption = None,
    planner: PlannerOption = None,
    speed: SpeedOption = None,
    seed: SeedOption = None,
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
    report: ReportOption = None,
) -> None:
    """Play against the engine; type moves, the robot makes them.

    Examples:

        kempelen play                              White against full strength, on the twin

        kempelen play --level 3 --side black       against a beginner

        kempelen play --port /dev/ttyUSB0 --hands person
    """
    settings = configured(
        config, engine__path=engine, engine__level=level, engine__move_time=move_time, robot__kind=robot,
        robot__port=port, planner__name=planner, twin__speed=speed, twin__seed=seed, data__dir=data_dir,
        play__side=side.value if side else None, play__hands=hands.value if hands else None,
    )  # fmt: skip
    start = parse_fen(fen).fen() if fen else chess.STARTING_FEN
    run_game(settings, GameRequest(Mode.PLAY, start, person_plays=settings.play.side == "white"), report)


def watch(
    opponent: Annotated[str, typer.Option("--opponent", help="Black's engine, if another one.")] = "",
    opponent_level: Annotated[
        str, typer.Option("--opponent-level", help="Black's level, if another one.")
    ] = "",
    fen: FenOption = None,
    engine: EngineOption = None,
    level: LevelOption = None,
    move_time: MoveTimeOption = None,
    robot: RobotOption = None,
    port: PortOption = None,
    planner: PlannerOption = None,
    speed: SpeedOption = None,
    seed: SeedOption = None,
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
    report: ReportOption = None,
) -> None:
    """Watch engine against engine.

    Example: kempelen watch --level 8 --opponent-level 12 --speed 5
    """
    settings = configured(
        config, engine__path=engine, engine__level=level, engine__move_time=move_time, robot__kind=robot,
        robot__port=port, planner__name=planner, twin__speed=speed, twin__seed=seed, data__dir=data_dir,
    )  # fmt: skip
    start = parse_fen(fen).fen() if fen else chess.STARTING_FEN
    request = GameRequest(Mode.WATCH, start, opponent=opponent, opponent_level=opponent_level)
    run_game(settings, request, report)


def replay(
    file: Annotated[Path, typer.Argument(help="PGN file.")],
    game: Annotated[int, typer.Option("--game", help="Which game of the file, from 1.")] = 1,
    take_over: Annotated[
        int | None, typer.Option("--take-over", help="Move number at which you take over.")
    ] = None,
    side: Annotated[Side, typer.Option("--side", help="Your colour after taking over.")] = Side.WHITE,
    engine: EngineOption = None,
    level: LevelOption = None,
    move_time: MoveTimeOption = None,
    robot: RobotOption = None,
    port: PortOption = None,
    planner: PlannerOption = None,
    speed: SpeedOption = None,
    seed: SeedOption = None,
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
    report: ReportOption = None,
) -> None:
    """Replay a game from a PGN file; take over from any move.

    Examples:

        kempelen replay famous.pgn --game 2 --speed max

        kempelen replay famous.pgn --game 4 --take-over 20 --side white
    """
    settings = configured(
        config, engine__path=engine, engine__level=level, engine__move_time=move_time, robot__kind=robot,
        robot__port=port, planner__name=planner, twin__speed=speed, twin__seed=seed, data__dir=data_dir,
    )  # fmt: skip
    score = read_game(file, game)
    request = GameRequest(
        Mode.REPLAY, score.start_fen, score=score, person_plays=side is Side.WHITE, take_over_move=take_over
    )
    run_game(settings, request, report)


def resume(
    game: Annotated[
        int | None, typer.Argument(help="Number of the game; the newest unfinished one when left out.")
    ] = None,
    robot: RobotOption = None,
    port: PortOption = None,
    planner: PlannerOption = None,
    speed: SpeedOption = None,
    seed: SeedOption = None,
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
    report: ReportOption = None,
) -> None:
    """Go on with a game after any exit, also with a piece in the gripper.

    Example: kempelen resume
    """
    settings = configured(
        config, robot__kind=robot, robot__port=port, planner__name=planner, twin__speed=speed,
        twin__seed=seed, data__dir=data_dir,
    )  # fmt: skip
    if game is None:
        with JournalReader(journal_path(settings.data_dir)) as journal:
            game = journal.latest(unfinished=True)
    run_game(settings, game, report)

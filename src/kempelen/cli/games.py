"""`kempelen play`, `watch`, `replay` and `resume`: their options, and the settings that these overrule."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from kempelen.cli.options import (
    BookOption,
    CameraOption,
    ConfigOption,
    DataDirOption,
    EngineOption,
    FenOption,
    LevelOption,
    MoveTimeOption,
    OtherEngineOption,
    OtherLevelOption,
    OtherMoveTimeOption,
    PlainOption,
    PlannerOption,
    PonderOption,
    PortOption,
    ReportOption,
    RobotOption,
    SeedOption,
    SensorOption,
    SpeedOption,
    TwinControlOption,
)
from kempelen.cli.showing import Showing

_GAME = "The game"

ClockOption = Annotated[
    str | None,
    typer.Option(
        "--clock",
        help="A chess clock: minutes for the game, and seconds more for each move: 5+3.",
        metavar="MINUTES+SECONDS",
        show_default="none",
        rich_help_panel=_GAME,
    ),
]


class Side(StrEnum):
    """The person's colour."""

    WHITE = "white"
    BLACK = "black"


class Hands(StrEnum):
    """Who carries the person's pieces."""

    ROBOT = "robot"
    PERSON = "person"


def play(
    side: Annotated[
        Side | None,
        typer.Option("--side", help="Your colour.", show_default="white", rich_help_panel=_GAME),
    ] = None,
    hands: Annotated[
        Hands | None,
        typer.Option(
            "--hands",
            help="Who carries your pieces.",
            show_default="you, where a camera looks",
            rich_help_panel=_GAME,
        ),
    ] = None,
    fen: FenOption = None,
    clock: ClockOption = None,
    engine: EngineOption = None,
    level: LevelOption = None,
    move_time: MoveTimeOption = None,
    book: BookOption = None,
    ponder: PonderOption = None,
    robot: RobotOption = None,
    port: PortOption = None,
    planner: PlannerOption = None,
    speed: SpeedOption = None,
    seed: SeedOption = None,
    twin_control: TwinControlOption = None,
    camera: CameraOption = None,
    sensor: SensorOption = None,
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
    report: ReportOption = None,
    plain: PlainOption = False,
) -> None:
    """Play against the engine: type moves, the robot makes them.

    Examples:

        kempelen play                            White, on the twin
        kempelen play --level 3 --side black     against a beginner
        kempelen play --level maia-1500          against somebody human
        kempelen play --level adaptive           as strong as you are
        kempelen play --engine fairymax --book people
        kempelen play --port /dev/ttyUSB0        on a real machine
        kempelen play --hands person             carry your pieces yourself
        kempelen play --clock 5+3                five minutes, three seconds a move
    """
    from kempelen.cli import start

    settings = start.configured(
        config, engine__path=engine, engine__level=level, engine__move_time=move_time, robot__kind=robot,
        robot__port=port, planner__name=planner, twin__speed=speed, twin__seed=seed,
        twin__control=twin_control, camera__source=camera, sensor__kind=sensor, data__dir=data_dir,
        engine__book=book, engine__ponder=ponder,
        play__side=side and side.value, play__hands=hands and hands.value,
    )  # fmt: skip
    start.play(settings, fen, clock, Showing(report, plain=plain))


def watch(
    opponent: Annotated[
        str,
        typer.Option("--opponent", help="Black's engine.", show_default="the same", rich_help_panel=_GAME),
    ] = "",
    opponent_level: Annotated[
        str,
        typer.Option(
            "--opponent-level", help="Black's level.", show_default="the same", rich_help_panel=_GAME
        ),
    ] = "",
    fen: FenOption = None,
    clock: ClockOption = None,
    engine: EngineOption = None,
    level: LevelOption = None,
    move_time: MoveTimeOption = None,
    book: BookOption = None,
    ponder: PonderOption = None,
    robot: RobotOption = None,
    port: PortOption = None,
    planner: PlannerOption = None,
    speed: SpeedOption = None,
    seed: SeedOption = None,
    twin_control: TwinControlOption = None,
    camera: CameraOption = None,
    sensor: SensorOption = None,
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
    report: ReportOption = None,
    plain: PlainOption = False,
) -> None:
    """Watch engine against engine; take a side at any time.

    Examples:

        kempelen watch --level 8 --opponent-level 12 --speed 5
        kempelen watch --engine stockfish --opponent maia-1900
    """
    from kempelen.cli import start

    settings = start.configured(
        config, engine__path=engine, engine__level=level, engine__move_time=move_time, robot__kind=robot,
        robot__port=port, planner__name=planner, twin__speed=speed, twin__seed=seed,
        twin__control=twin_control, camera__source=camera, sensor__kind=sensor, data__dir=data_dir,
        engine__book=book, engine__ponder=ponder,
    )  # fmt: skip
    start.watch(settings, fen, clock, opponent, opponent_level, Showing(report, plain=plain))


def replay(
    file: Annotated[Path, typer.Argument(help="PGN file.", metavar="FILE.pgn")],
    game: Annotated[
        int, typer.Option("--game", help="Which game of the file, from 1.", rich_help_panel=_GAME)
    ] = 1,
    take_over: Annotated[
        int | None,
        typer.Option("--take-over", help="Move number at which you take over.", rich_help_panel=_GAME),
    ] = None,
    side: Annotated[
        Side, typer.Option("--side", help="Your colour after taking over.", rich_help_panel=_GAME)
    ] = Side.WHITE,
    engine: EngineOption = None,
    level: LevelOption = None,
    move_time: MoveTimeOption = None,
    robot: RobotOption = None,
    port: PortOption = None,
    planner: PlannerOption = None,
    speed: SpeedOption = None,
    seed: SeedOption = None,
    twin_control: TwinControlOption = None,
    camera: CameraOption = None,
    sensor: SensorOption = None,
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
    report: ReportOption = None,
    plain: PlainOption = False,
) -> None:
    """Replay a game from a PGN file; take over from any move.

    Examples:

        kempelen replay famous.pgn --game 2 --speed max
        kempelen replay famous.pgn --game 4 --take-over 20 --side white
    """
    from kempelen.cli import start

    settings = start.configured(
        config, engine__path=engine, engine__level=level, engine__move_time=move_time, robot__kind=robot,
        robot__port=port, planner__name=planner, twin__speed=speed, twin__seed=seed,
        twin__control=twin_control, camera__source=camera, sensor__kind=sensor, data__dir=data_dir,
    )  # fmt: skip
    start.replay(settings, file, game, take_over, side.value, Showing(report, plain=plain))


def resume(
    game: Annotated[
        int | None,
        typer.Argument(help="Number of the game.", show_default="the newest unfinished one"),
    ] = None,
    engine: OtherEngineOption = None,
    level: OtherLevelOption = None,
    move_time: OtherMoveTimeOption = None,
    robot: RobotOption = None,
    port: PortOption = None,
    planner: PlannerOption = None,
    speed: SpeedOption = None,
    seed: SeedOption = None,
    twin_control: TwinControlOption = None,
    camera: CameraOption = None,
    sensor: SensorOption = None,
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
    report: ReportOption = None,
    plain: PlainOption = False,
) -> None:
    """Go on with a game after any exit, also with a piece in the gripper.

    Players, engine, level and hands are those of the game; engines may be changed.

    Examples:

        kempelen resume           the newest unfinished game
        kempelen resume 3
        kempelen resume --level 5 --move-time 0.2
    """
    from kempelen.app.cast import EngineWish
    from kempelen.cli import start

    settings = start.configured(
        config, engine__path=engine, engine__level=level, engine__move_time=move_time, robot__kind=robot,
        robot__port=port, planner__name=planner, twin__speed=speed,
        twin__seed=seed,
        twin__control=twin_control, camera__source=camera, sensor__kind=sensor, data__dir=data_dir,
    )  # fmt: skip
    wish = EngineWish(engine, level, move_time)
    start.resume(settings, game, Showing(report, plain=plain), wish)

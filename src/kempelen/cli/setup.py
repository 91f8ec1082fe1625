"""`kempelen setup`: the robot sets up a position from wherever the pieces stand."""

from typing import Annotated

import typer

from kempelen.cli.options import (
    CameraOption,
    ConfigOption,
    DataDirOption,
    PlainOption,
    PlannerOption,
    PortOption,
    ReportOption,
    RobotOption,
    SeedOption,
    SensorOption,
    SpeedOption,
    TwinControlOption,
)
from kempelen.cli.showing import Showing


def setup(
    position: Annotated[
        str | None,
        typer.Argument(metavar="[FEN]", help="The position wanted.", show_default="the beginning of a game"),
    ] = None,
    standing: Annotated[
        str,
        typer.Option(
            "--from",
            metavar="last|NUMBER|FEN",
            help="Where the pieces stand now: as the last game, or game NUMBER, left them, or as told.",
        ),
    ] = "last",
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
    """Let the robot set up a position: the start of a game, a puzzle.

    It takes the fewest transfers that there can be, captured pieces and spares in the trays included. Like a
    game it is kept in the journal step by step: it can be left and resumed, and nothing is lost.

    Examples:

        kempelen setup                                     the board again after the last game
        kempelen setup "6k1/5ppp/8/8/8/8/8/R5K1 w - -"     a puzzle
        kempelen setup --from 12                           from where game 12 left the pieces
    """
    from kempelen.cli import start

    settings = start.configured(
        config, robot__kind=robot, robot__port=port, planner__name=planner, twin__speed=speed,
        twin__seed=seed, twin__control=twin_control, camera__source=camera, sensor__kind=sensor,
        data__dir=data_dir,
    )  # fmt: skip
    start.setup(settings, position, standing, Showing(report, plain=plain))

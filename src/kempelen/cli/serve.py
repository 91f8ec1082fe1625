"""`kempelen serve`: the web page."""

from typing import Annotated

import typer

from kempelen.cli.options import (
    BookOption,
    CameraOption,
    ConfigOption,
    DataDirOption,
    EngineOption,
    LevelOption,
    MoveTimeOption,
    PlannerOption,
    PonderOption,
    RobotOption,
    SeedOption,
    SensorOption,
    SpeedOption,
)

_SERVER = "The server"

HostOption = Annotated[
    str,
    typer.Option(
        "--host",
        help="Address to listen on; 0.0.0.0 for everybody in the network.",
        rich_help_panel=_SERVER,
    ),
]
HttpPortOption = Annotated[
    int | None,
    typer.Option(
        "--port",
        help="Port to listen on; 0 for any.",
        min=0,
        max=65535,
        show_default="8420, or the next that is free",
        rich_help_panel=_SERVER,
    ),
]
RobotPortOption = Annotated[
    str | None,
    typer.Option(
        "--robot-port",
        help="twin, /dev/ttyUSB0 or socket://HOST:PORT.",
        show_default="twin",
        rich_help_panel="The robot",
    ),
]


def serve(
    host: HostOption = "127.0.0.1",
    port: HttpPortOption = None,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Print the address only.", rich_help_panel=_SERVER)
    ] = False,
    tls: Annotated[
        bool,
        typer.Option("--tls", help="Encrypt, with a certificate made here.", rich_help_panel=_SERVER),
    ] = False,
    password: Annotated[
        str,
        typer.Option(
            "--password",
            envvar="KEMPELEN_PASSWORD",
            show_envvar=True,
            help="Lets operators in, beside the link that is printed.",
            show_default="none",
            rich_help_panel=_SERVER,
        ),
    ] = "",
    player_password: Annotated[
        str,
        typer.Option(
            "--player-password",
            envvar="KEMPELEN_PLAYER_PASSWORD",
            show_envvar=True,
            help="Lets players in.",
            show_default="none",
            rich_help_panel=_SERVER,
        ),
    ] = "",
    name: Annotated[
        list[str] | None,
        typer.Option("--name", help="One more host name that leads here.", rich_help_panel=_SERVER),
    ] = None,
    engine: EngineOption = None,
    level: LevelOption = None,
    move_time: MoveTimeOption = None,
    book: BookOption = None,
    ponder: PonderOption = None,
    robot: RobotOption = None,
    robot_port: RobotPortOption = None,
    planner: PlannerOption = None,
    speed: SpeedOption = None,
    seed: SeedOption = None,
    camera: CameraOption = None,
    sensor: SensorOption = None,
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
) -> None:
    """Open the web page: set up, calibrate, play, look on.

    Examples:

        kempelen serve                              this machine alone
        kempelen serve --robot-port /dev/ttyUSB0    on a real machine
        kempelen serve --host 0.0.0.0 --tls         for the whole network, encrypted
    """
    from kempelen.cli import serve_run, start

    settings = start.configured(
        config, engine__path=engine, engine__level=level, engine__move_time=move_time, robot__kind=robot,
        robot__port=robot_port, planner__name=planner, twin__speed=speed, twin__seed=seed,
        camera__source=camera, sensor__kind=sensor, data__dir=data_dir,
        engine__book=book, engine__ponder=ponder,
    )  # fmt: skip
    serve_run.run(
        settings, host=host, port=port, tls=tls, names=name or (), browser=not no_browser,
        passwords={"operator": password, "player": player_password},
    )  # fmt: skip

"""`kempelen node`: robot, board and engine as programs of their own, on as many machines as wanted."""

from pathlib import Path
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
    PonderOption,
    PortOption,
    RobotOption,
    SeedOption,
    SensorOption,
    SpeedOption,
)

node = typer.Typer(
    name="node",
    help="""Robots, boards, cameras and engines on other machines, found over the network.

    Examples:

        kempelen node robot --table hall-3        beside the robot
        kempelen node arbiter --table hall-3      where the game is led
        kempelen node view                        every table in the hall
    """,
    no_args_is_help=True,
    rich_markup_mode="rich",
)

TableOption = Annotated[
    str, typer.Option("--table", help="Name of the table at which it stands.", metavar="NAME")
]
ConnectOption = Annotated[
    list[str] | None,
    typer.Option(
        "--connect",
        help="Endpoint of another program, beyond this network: tcp/10.0.0.5:7447. May be repeated.",
    ),
]
ListenOption = Annotated[
    list[str] | None,
    typer.Option("--listen", help="Own endpoint: tcp/0.0.0.0:7447. May be repeated."),
]
KeysOption = Annotated[
    Path | None, typer.Option("--keys", help="Folder of this machine's keys, of: kempelen node keys")
]


@node.command("robot")
def robot_node(
    table: TableOption = "one",
    robot: RobotOption = None,
    port: PortOption = None,
    speed: SpeedOption = None,
    seed: SeedOption = None,
    sensor: SensorOption = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    keys: KeysOption = None,
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
) -> None:
    """Offer the robot at this machine, or its twin, to whoever plays at the table.

    One program leads it at a time. When that one falls silent, the robot comes to rest by itself and keeps
    what it holds; nothing is carried out late or twice.

    Examples:

        kempelen node robot --table hall-3 --port /dev/ttyUSB0
        kempelen play --port node:hall-3                          on any machine of the network
        kempelen node robot --sensor camera,reed                  a twin with its camera and its reed board
    """
    from kempelen.cli import node_run, start

    settings = start.configured(
        config, robot__kind=robot, robot__port=port, twin__speed=speed, twin__seed=seed,
        data__dir=data_dir, network__connect=connect, network__listen=listen,
        network__keys=keys, sensor__kind=sensor or "none",
    )  # fmt: skip
    node_run.run_robot(settings, table)


@node.command("board")
def board_node(
    table: TableOption = "one",
    port: Annotated[
        str | None,
        typer.Option("--port", help="/dev/ttyUSB1 or socket://HOST:PORT.", show_default="where one answers"),
    ] = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    keys: KeysOption = None,
    config: ConfigOption = None,
) -> None:
    """Offer the reed board at this machine to whoever plays at the table.

    Examples:

        kempelen node board --table hall-3
        kempelen node arbiter --table hall-3 --sensor reed        on any machine of the network
    """
    from kempelen.cli import node_run, start

    settings = start.configured(
        config, sensor__kind="reed", sensor__port=port, network__connect=connect, network__listen=listen,
        network__keys=keys,
    )  # fmt: skip
    node_run.run_device(settings, table, "board")


@node.command("camera")
def camera_node(
    table: TableOption = "one",
    camera: CameraOption = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    keys: KeysOption = None,
    config: ConfigOption = None,
) -> None:
    """Offer what the camera at this machine sees of the table. Its pictures stay on this machine.

    Examples:

        kempelen node camera --table hall-3 --camera uvc:0
        kempelen node arbiter --table hall-3 --sensor camera      on any machine of the network
    """
    from kempelen.cli import node_run, start

    settings = start.configured(
        config, sensor__kind="camera", camera__source=camera, network__connect=connect,
        network__listen=listen, network__keys=keys,
    )  # fmt: skip
    node_run.run_device(settings, table, "camera")


@node.command("engine")
def engine_node(
    name: Annotated[str, typer.Option("--name", help="By which it is found.", metavar="NAME")] = "one",
    engine: EngineOption = None,
    level: LevelOption = None,
    move_time: MoveTimeOption = None,
    book: BookOption = None,
    ponder: PonderOption = None,
    seed: SeedOption = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    keys: KeysOption = None,
    config: ConfigOption = None,
) -> None:
    """Offer an engine of this machine to whoever plays, under a name.

    It thinks about one position at a time; others wait for it. A question that is asked twice is answered
    once.

    Examples:

        kempelen node engine --name strong --engine stockfish
        kempelen play --engine node:strong                        on any machine of the network
    """
    from kempelen.cli import node_run, start

    settings = start.configured(
        config, engine__path=engine, engine__level=level, engine__move_time=move_time, engine__book=book,
        engine__ponder=ponder, twin__seed=seed, network__connect=connect, network__listen=listen,
        network__keys=keys,
    )  # fmt: skip
    node_run.run_engine(settings, name)


@node.command("arbiter")
def arbiter_node(
    table: TableOption = "one",
    host: Annotated[str, typer.Option("--host", help="Address at which the page is served.")] = "127.0.0.1",
    http_port: Annotated[
        int | None,
        typer.Option(
            "--http-port", help="Port of the page; 0 for any.", min=0, max=65535, show_default="8420"
        ),
    ] = None,
    tls: Annotated[bool, typer.Option("--tls", help="Encrypt the page.")] = False,
    engine: EngineOption = None,
    level: LevelOption = None,
    move_time: MoveTimeOption = None,
    robot: RobotOption = None,
    speed: SpeedOption = None,
    sensor: SensorOption = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    keys: KeysOption = None,
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
) -> None:
    """Lead a table whose robot, board, camera and engine are at nodes; the page is served here.

    Examples:

        kempelen node arbiter --table hall-3
        kempelen node arbiter --table hall-3 --engine node:strong --sensor reed
        kempelen node arbiter --table hall-3 --keys keys/desk --connect tls/10.0.0.5:7447
    """
    from kempelen.cli import node_run, start

    settings = start.configured(
        config, engine__path=engine, engine__level=level, engine__move_time=move_time, robot__kind=robot,
        robot__port=f"node:{table}", twin__speed=speed, sensor__kind=sensor or "none", data__dir=data_dir,
        camera__source=f"node:{table}", sensor__port=f"node:{table}", network__table=table,
        network__connect=connect, network__listen=listen, network__keys=keys,
    )  # fmt: skip
    node_run.run_arbiter(settings, host, http_port, tls=tls)


@node.command("view")
def view(
    seconds: Annotated[
        float | None,
        typer.Option(
            "--seconds", help="Look for so long, then print what was seen.", min=0.5, show_default="on"
        ),
    ] = None,
    connect: ConnectOption = None,
    keys: KeysOption = None,
    config: ConfigOption = None,
) -> None:
    """List every table in the hall: who plays, how it stands, what the robot does, what is wrong.

    Examples:

        kempelen node view                                    every table on this network, live
        kempelen node view --connect tcp/10.0.0.5:7447        those of another network as well
        kempelen node view --seconds 3                        once, for a script
    """
    from kempelen.cli import node_view, start

    settings = start.configured(config, network__connect=connect, network__keys=keys)
    node_view.run_view(settings, seconds)


@node.command("hall")
def hall(
    tables: Annotated[int, typer.Option("--tables", help="How many.", min=1, max=10_000)] = 8,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    keys: KeysOption = None,
    config: ConfigOption = None,
) -> None:
    """Run light tables that play by themselves: something to look at, and a load for the network.

    Examples:

        kempelen node hall --tables 20        then, elsewhere: kempelen node view
    """
    from kempelen.cli import node_run, start

    settings = start.configured(config, network__connect=connect, network__listen=listen, network__keys=keys)
    node_run.run_hall(settings, tables)


@node.command("keys")
def keys_command(
    name: Annotated[str | None, typer.Argument(help="Of the machine.", show_default="as the role")] = None,
    role: Annotated[
        str | None,
        typer.Option("--role", help="robot, board, camera, engine, arbiter or view.", show_default=False),
    ] = None,
    days: Annotated[int, typer.Option("--days", help="How long they are valid.", min=1, max=3650)] = 397,
    show: Annotated[bool, typer.Option("--show", help="List all keys: whose, until when.")] = False,
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
) -> None:
    """Make keys by which machines know each other: then nobody else can join, listen or give orders.

    The authority is made with the first ones, and stays on this machine. Each machine gets a folder, which
    says what its program may do: a view, for example, may look on, and nothing else.

    Examples:

        kempelen node keys pi-3 --role robot              a folder to copy to the robot's machine
        kempelen node robot --table hall-3 --keys pi-3    there
        kempelen node keys --show
    """
    from kempelen.cli import node_keys, start

    settings = start.configured(config, data__dir=data_dir)
    if show or role is None:
        node_keys.show_keys(settings, asked=show)
    else:
        node_keys.make(settings, role, name or role, days)

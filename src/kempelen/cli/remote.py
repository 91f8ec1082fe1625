"""`kempelen remote …`: drive a server that runs."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kempelen.cli.options import ConfigOption, DataDirOption

if TYPE_CHECKING:
    from kempelen.cli.remote_run import Remote

remote = typer.Typer(
    name="remote",
    no_args_is_help=True,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)

_GAME = "The game"
_ROBOT = "The robot"


class RemoteMode(StrEnum):
    """Who plays whom."""

    PLAY = "play"
    WATCH = "watch"
    REPLAY = "replay"


class RemoteSide(StrEnum):
    """A colour."""

    WHITE = "white"
    BLACK = "black"


class RemoteRole(StrEnum):
    """For whom a link is."""

    OPERATOR = "operator"
    PLAYER = "player"


@remote.callback()
def _where(
    context: typer.Context,
    url: Annotated[
        str,
        typer.Option("--url", help="Of another server; its password is needed.", show_default="this user's"),
    ] = "",
    password: Annotated[
        str, typer.Option("--password", envvar="KEMPELEN_PASSWORD", show_envvar=True, help="For --url.")
    ] = "",
    certificate: Annotated[
        Path | None, typer.Option("--certificate", help="Of the server at --url, if it made its own.")
    ] = None,
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
) -> None:
    """Drive a server that runs (`kempelen serve`) from the terminal.

    Examples:

        kempelen remote status
        kempelen remote new --level 3
        kempelen remote move Nf3
        kempelen remote estop
    """

    def connect_to() -> "Remote":
        from kempelen.cli.remote_run import Remote

        if url:
            return Remote(url, password=password, certificate=certificate)
        from kempelen.cli import start
        from kempelen.server.doorplate import read

        address = read(start.configured(config, data__dir=data_dir).data_dir)
        kept = Path(address.certificate) if address.certificate else None
        return Remote(address.origin, session=address.session, certificate=kept)

    context.obj = connect_to


def _do(context: typer.Context, name: str, **values: object) -> None:
    """One command; what came of it is printed."""
    with context.obj() as server:
        typer.echo(server.obey(name, **values))


@remote.command()
def status(context: typer.Context) -> None:
    """Tell what is going on.

    Examples:

        kempelen remote status
    """
    with context.obj() as server:
        typer.echo(server.status())


@remote.command()
def link(
    context: typer.Context,
    role: Annotated[RemoteRole, typer.Option("--role", help="What it lets do.")] = RemoteRole.OPERATOR,
) -> None:
    """Make a link that lets one browser in.

    Examples:

        kempelen remote link
        kempelen remote link --role player
    """
    with context.obj() as server:
        typer.echo(server.link(role.value))


@remote.command()
def follow(
    context: typer.Context,
    count: Annotated[int, typer.Option("--count", help="End after so many lines; 0 for never.", min=0)] = 0,
) -> None:
    """Print what happens, as it happens.

    Examples:

        kempelen remote follow
    """
    with context.obj() as server:
        for line in server.follow(count):
            typer.echo(line)


@remote.command(rich_help_panel=_GAME)
def new(
    context: typer.Context,
    mode: Annotated[RemoteMode, typer.Argument(help="Who plays whom.")] = RemoteMode.PLAY,
    side: Annotated[RemoteSide, typer.Option("--side", help="Your colour.")] = RemoteSide.WHITE,
    level: Annotated[str, typer.Option("--level", help="1 to 20, an Elo, maia-1500, full.")] = "full",
    move_time: Annotated[float, typer.Option("--move-time", help="Seconds for each engine move.")] = 1.0,
    fen: Annotated[
        str, typer.Option("--fen", help="Start from this position.", show_default="the usual one")
    ] = "",
    pgn: Annotated[Path | None, typer.Option("--pgn", help="File with the game to replay.")] = None,
    game: Annotated[int, typer.Option("--game", help="Which game of it, from 1.", min=1)] = 1,
) -> None:
    """Begin a game.

    Examples:

        kempelen remote new --level 3 --side black
        kempelen remote new watch --level 8
        kempelen remote new replay --pgn famous.pgn --game 2
    """
    from kempelen.cli.remote_run import text_of

    _do(
        context, "new_game", mode=mode.value, side=side.value, level=level, move_time=move_time, fen=fen,
        pgn="" if pgn is None else text_of(pgn), pgn_game=game,
    )  # fmt: skip


@remote.command("set-up", rich_help_panel=_GAME)
def set_up(
    context: typer.Context,
    fen: Annotated[
        str, typer.Argument(help="The position wanted.", show_default="the beginning of a game")
    ] = "",
    standing: Annotated[
        str, typer.Option("--from", help="Where the pieces are: last, a game's number, or a FEN.")
    ] = "last",
) -> None:
    """Let the robot set up a position.

    Examples:

        kempelen remote set-up
    """
    _do(context, "set_up", fen=fen, standing=standing)


@remote.command("go-on", rich_help_panel=_GAME)
def go_on(
    context: typer.Context,
    game: Annotated[
        int | None, typer.Argument(help="Number of the game.", show_default="the newest unfinished one")
    ] = None,
) -> None:
    """Go on with a game of the journal.

    Examples:

        kempelen remote go-on
    """
    _do(context, "resume_game", game=game)


@remote.command(rich_help_panel=_GAME)
def leave(context: typer.Context) -> None:
    """Leave the game; it is kept.

    Examples:

        kempelen remote leave
    """
    _do(context, "leave_game")


@remote.command(rich_help_panel=_GAME)
def move(
    context: typer.Context,
    text: Annotated[str, typer.Argument(help="In any notation: e4, Nf3, e2e4, O-O.", metavar="MOVE")],
) -> None:
    """Make a move of the person's side.

    Examples:

        kempelen remote move e4
        kempelen remote move e8=N
    """
    with context.obj() as server:
        typer.echo(server.move(text))


@remote.command(rich_help_panel=_GAME)
def pause(context: typer.Context) -> None:
    """Stop the robot at once; `resume` goes on.

    Examples:

        kempelen remote pause
    """
    _do(context, "pause")


@remote.command(rich_help_panel=_GAME)
def resume(context: typer.Context) -> None:
    """Go on after `pause`.

    Examples:

        kempelen remote resume
    """
    _do(context, "resume")


@remote.command(rich_help_panel=_GAME)
def finish(context: typer.Context) -> None:
    """Complete the move in hand, while paused.

    Examples:

        kempelen remote finish
    """
    _do(context, "finish")


@remote.command(rich_help_panel=_GAME)
def takeback(
    context: typer.Context,
    plies: Annotated[
        int | None, typer.Argument(help="Half-moves.", show_default="to where a person was to move", min=1)
    ] = None,
) -> None:
    """Undo moves, on the table too.

    Examples:

        kempelen remote takeback 2
    """
    _do(context, "takeback", plies=plies)


@remote.command(rich_help_panel=_GAME)
def resign(context: typer.Context) -> None:
    """Give up.

    Examples:

        kempelen remote resign
    """
    _do(context, "resign")


@remote.command(rich_help_panel=_GAME)
def draw(context: typer.Context) -> None:
    """Offer a draw.

    Examples:

        kempelen remote draw
    """
    _do(context, "draw")


@remote.command(rich_help_panel=_ROBOT)
def estop(context: typer.Context) -> None:
    """End all motion now.

    Examples:

        kempelen remote estop
    """
    _do(context, "estop")


@remote.command(rich_help_panel=_ROBOT)
def recover(context: typer.Context) -> None:
    """Clear an alarm or a stop.

    Examples:

        kempelen remote recover
    """
    _do(context, "recover")


@remote.command(rich_help_panel=_ROBOT)
def home(context: typer.Context) -> None:
    """Find the reference switches.

    Examples:

        kempelen remote home
    """
    _do(context, "home")


@remote.command(rich_help_panel=_ROBOT)
def connect(
    context: typer.Context,
    port: Annotated[str, typer.Argument(help="twin, /dev/ttyUSB0 or socket://HOST:PORT.")] = "twin",
    kind: Annotated[str, typer.Option("--robot", help="The driver's name.")] = "gantry",
) -> None:
    """Connect a robot.

    Examples:

        kempelen remote connect /dev/ttyUSB0
    """
    _do(context, "connect", kind=kind, port=port)


@remote.command(rich_help_panel=_ROBOT)
def disconnect(context: typer.Context) -> None:
    """Let go of the robot.

    Examples:

        kempelen remote disconnect
    """
    _do(context, "disconnect")


@remote.command(rich_help_panel=_ROBOT)
def speed(
    context: typer.Context,
    scale: Annotated[float, typer.Argument(help="Time scale; 0 for as fast as it can.", min=0, max=1000)],
) -> None:
    """Set the twin's pace.

    Examples:

        kempelen remote speed 5
    """
    _do(context, "speed", speed=scale)

"""The `kempelen` command.

The modules imported here hold options and help texts only; what a command needs is imported when it runs, so
that `--help` and `--version` are there at once.
"""

import sys
from typing import Annotated

import typer

from kempelen import __version__
from kempelen.cli import games, records
from kempelen.cli.arm import arm
from kempelen.cli.bench import bench
from kempelen.cli.calibrate import calibrate_board
from kempelen.cli.doctor import config, doctor
from kempelen.cli.engines import engines
from kempelen.cli.jog import jog
from kempelen.cli.node import node
from kempelen.cli.record import record
from kempelen.cli.remote import remote
from kempelen.cli.see import see
from kempelen.cli.serve import serve
from kempelen.cli.setup import setup
from kempelen.cli.twin import twin
from kempelen.core.errors import KempelenError

app = typer.Typer(
    name="kempelen",
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"kempelen {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """The chess robot that anyone can run.

    Begin with:

        kempelen                 the web page, on the twin; no machine is needed
        kempelen play            a game in the terminal
        kempelen doctor          what is there, what is missing, and what to do
    """
    del version
    if context.invoked_subcommand is None:
        context.invoke(serve)


_GAMES = "Games"
_MACHINE = "The machine"
_HOUSE = "Checks and measurements"

app.command(rich_help_panel=_GAMES)(serve)
for _command in (games.play, games.watch, games.replay, games.resume, setup, records.games, records.pgn):
    app.command(rich_help_panel=_GAMES)(_command)
app.add_typer(remote, rich_help_panel=_GAMES)
app.add_typer(node, rich_help_panel=_GAMES)
app.command("calibrate", rich_help_panel=_MACHINE)(calibrate_board)
app.add_typer(arm, rich_help_panel=_MACHINE)
app.command(rich_help_panel=_MACHINE)(jog)
app.command(rich_help_panel=_MACHINE)(see)
app.command(rich_help_panel=_MACHINE)(record)
app.command(rich_help_panel=_MACHINE)(twin)
app.command(rich_help_panel=_HOUSE)(doctor)
app.command(rich_help_panel=_HOUSE)(config)
app.command(rich_help_panel=_HOUSE)(engines)
app.command(rich_help_panel=_HOUSE)(bench)


def main() -> None:
    """Run the command line; every error is told in words, with the next step."""
    try:
        app()
    except KempelenError as error:
        _tell(error)
        sys.exit(error.exit_code)
    except typer.Abort:
        sys.exit(130)
    except Exception as error:  # noqa: BLE001 - the last net: nobody should have to read a traceback
        from kempelen.cli.trouble import tell_fault

        sys.exit(tell_fault(error))


def _tell(error: KempelenError) -> None:
    from kempelen.cli.trouble import tell

    tell(error)

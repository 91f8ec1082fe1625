"""The `kempelen` command."""

import sys
from typing import Annotated

import typer
from rich.console import Console

from kempelen import __version__
from kempelen.cli import games, records
from kempelen.cli.bench import bench
from kempelen.cli.calibrate import calibrate_board
from kempelen.cli.doctor import config, doctor
from kempelen.cli.jog import jog
from kempelen.cli.twin import twin
from kempelen.core.errors import KempelenError

app = typer.Typer(
    name="kempelen",
    help="The chess robot that anyone can run. Begin with: kempelen play",
    no_args_is_help=True,
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
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """The chess robot that anyone can run."""


app.command()(games.play)
app.command()(games.watch)
app.command()(games.replay)
app.command()(games.resume)
app.command()(records.games)
app.command()(records.pgn)
app.command("calibrate")(calibrate_board)
app.command()(jog)
app.command()(doctor)
app.command()(config)
app.command()(bench)
app.command()(twin)


def main() -> None:
    """Run the command line; every error of ours is told in words, with the next step."""
    try:
        app()
    except KempelenError as error:
        console = Console(stderr=True)
        console.print(f"[bold red]{type(error).__name__}[/]:", end=" ")
        console.print(error.message, markup=False, highlight=False, soft_wrap=True)
        if error.hint:
            console.print(error.hint, markup=False, highlight=False, soft_wrap=True, style="yellow")
        sys.exit(error.exit_code)
    except typer.Abort:
        sys.exit(130)

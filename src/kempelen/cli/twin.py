"""`kempelen twin`: the simulated robot on its own, for any program that speaks GRBL."""

import tempfile
from pathlib import Path
from typing import Annotated

import chess
import typer

from kempelen.app.config import load_config
from kempelen.app.speed import parse_speed
from kempelen.cli.options import ConfigOption
from kempelen.core.table import start_layout
from kempelen.game.fen import parse_fen
from kempelen.twin.loop import TwinLoop
from kempelen.twin.spec import TwinSpec


def twin(
    wire: Annotated[
        str, typer.Option(help="pty, or tcp:PORT on this machine (tcp:0: any free port).")
    ] = "pty",
    link: Annotated[
        Path | None, typer.Option(help="Keep a symbolic link to the pseudo-terminal here.")
    ] = None,
    speed: Annotated[str, typer.Option(help="Time scale: 1, N or max.")] = "1",
    fen: Annotated[str, typer.Option(help="Position that the pieces stand in.")] = chess.STARTING_FEN,
    seed: Annotated[
        int, typer.Option(help="How the pieces stand off centre, and how clumsy the person is.")
    ] = 0,
    state: Annotated[Path | None, typer.Option(help="Keep the table here between runs.")] = None,
    keep: Annotated[bool, typer.Option("--keep", help="Go on from --state instead of setting up.")] = False,
    control: Annotated[Path | None, typer.Option(help="Side door for tests: path of a Unix socket.")] = None,
    config: ConfigOption = None,
) -> None:
    """Run the physics twin: a virtual GRBL controller, a gantry and all the pieces.

    Examples:

        kempelen twin --link /tmp/kempelen        then: kempelen play --port /tmp/kempelen

        kempelen twin --wire tcp:2300 --speed max
    """
    table = load_config(config).build_table()
    with tempfile.TemporaryDirectory(prefix="kempelen-") as folder:
        spec = TwinSpec.of(
            table,
            start_layout(table, parse_fen(fen)),
            control=control or Path(folder) / "control",
            wire=wire,
            link=str(link or ""),
            speed=parse_speed(speed),
            seed=seed,
            state=str(state or ""),
            resume=keep,
        )
        loop = TwinLoop(spec)
        typer.echo(f"The twin's controller is at {loop.address} (115200 baud). Ctrl-C ends it.")
        loop.run()

"""A twin in the foreground."""

import tempfile
from pathlib import Path

import chess
import typer
from pydantic import ValidationError

from kempelen.app.arm_setup import arm_spec
from kempelen.app.config import load_config
from kempelen.app.speed import parse_speed
from kempelen.core.errors import ConfigError
from kempelen.core.table import start_layout
from kempelen.game.fen import parse_fen
from kempelen.twin.loop import TwinLoop
from kempelen.twin.spec import TwinSpec


def run_twin(
    config: Path | None,
    robot: str | None,
    fen: str | None,
    speed: str,
    control: Path | None,
    **options: object,
) -> None:
    """Until Ctrl-C; ``robot`` is its kind, ``options`` are further fields of the spec.

    Raises:
        ConfigError: an option is out of range.
        TwinError: the wire cannot be made.
    """
    if options.get("resume") and not options.get("state"):
        raise ConfigError("--keep goes on from a table that was kept.", hint="Name its file: --state FILE")
    settings = load_config(config, {"robot.kind": robot})
    table = settings.build_table()
    layout = start_layout(table, parse_fen(fen) if fen is not None else chess.Board())
    with tempfile.TemporaryDirectory(prefix="kempelen-") as folder:
        try:
            spec = TwinSpec.of(
                table,
                layout,
                control=control or Path(folder) / "control",
                speed=parse_speed(speed),
                scatter=settings.twin.scatter,
                arm=arm_spec(settings),
                **options,
            )
        except ValidationError as error:
            raise _wrong_option(error) from None
        loop = TwinLoop(spec)
        typer.echo(f"The twin's controller is at {loop.address} (115200 baud). Ctrl-C ends it.")
        loop.run()


def _wrong_option(error: ValidationError) -> ConfigError:
    first = error.errors(include_url=False)[0]
    name = ".".join(map(str, first["loc"]))
    return ConfigError(f"--{name} cannot be '{first['input']}'.", hint="See: kempelen twin --help")

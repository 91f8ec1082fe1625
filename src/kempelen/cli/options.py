"""Options that many commands share, declared once."""

from pathlib import Path
from typing import Annotated

import typer

_GAME = "The game"
_ROBOT = "The robot"

ConfigOption = Annotated[
    Path | None, typer.Option("--config", help="Configuration file (TOML). See `kempelen config`.")
]
DataDirOption = Annotated[
    Path | None,
    typer.Option(
        "--data-dir", envvar="KEMPELEN_DATA_DIR", help="Where journal, calibration and PGN are kept."
    ),
]
RobotOption = Annotated[
    str | None, typer.Option("--robot", help="Kind of robot: gantry.", rich_help_panel=_ROBOT)
]
PortOption = Annotated[
    str | None,
    typer.Option(
        "--port", help="twin, /dev/ttyUSB0 or socket://HOST:PORT. Default: twin.", rich_help_panel=_ROBOT
    ),
]
SpeedOption = Annotated[
    str | None,
    typer.Option("--speed", help="Time scale of the twin: 1, N or max.", rich_help_panel=_ROBOT),
]
PlannerOption = Annotated[
    str | None,
    typer.Option("--planner", help="asynchronous, safe-height or supercover.", rich_help_panel=_ROBOT),
]
SeedOption = Annotated[
    int | None,
    typer.Option(
        "--seed", help="Of everything random: the twin's pieces, sampled moves.", rich_help_panel=_ROBOT
    ),
]
EngineOption = Annotated[
    str | None,
    typer.Option(
        "--engine", help="Path or name of a UCI engine. Default: the best at hand.", rich_help_panel=_GAME
    ),
]
LevelOption = Annotated[
    str | None,
    typer.Option("--level", help="1 (beginner) to 20, an Elo, maia-1500, or full.", rich_help_panel=_GAME),
]
MoveTimeOption = Annotated[
    float | None, typer.Option("--move-time", help="Seconds for each engine move.", rich_help_panel=_GAME)
]
FenOption = Annotated[
    str | None, typer.Option("--fen", help="Start from this position.", rich_help_panel=_GAME)
]
ReportOption = Annotated[
    Path | None, typer.Option("--report", help="Write a report of the game to this file (JSON).")
]
YesOption = Annotated[
    bool, typer.Option("--yes", "-y", help="Do not ask; take the operator's help as given.")
]

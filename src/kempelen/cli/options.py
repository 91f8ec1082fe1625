"""Options that many commands share, declared once.

Those left out keep what the configuration says; the defaults shown are those of the built-in configuration.
"""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer


class Edge(StrEnum):
    """A side of a picture."""

    BOTTOM = "bottom"
    TOP = "top"
    LEFT = "left"
    RIGHT = "right"


_GAME = "The game"
_ROBOT = "The robot"
_FILES = "Files and screen"

ConfigOption = Annotated[
    Path | None,
    typer.Option(
        "--config",
        help="Configuration file (TOML); `kempelen config` prints one.",
        show_default="the user's own, if there is one",
        rich_help_panel=_FILES,
    ),
]
DataDirOption = Annotated[
    Path | None,
    typer.Option(
        "--data-dir",
        envvar="KEMPELEN_DATA_DIR",
        help="Where journal, calibration and PGN are kept.",
        show_default="the system's usual place",
        rich_help_panel=_FILES,
    ),
]
RobotOption = Annotated[
    str | None,
    typer.Option(
        "--robot",
        help="Kind of robot: gantry, arm, or the name of another driver.",
        show_default="gantry",
        rich_help_panel=_ROBOT,
    ),
]
PortOption = Annotated[
    str | None,
    typer.Option(
        "--port",
        help="twin, /dev/ttyUSB0, socket://HOST:PORT, or node:TABLE on another machine.",
        show_default="twin",
        rich_help_panel=_ROBOT,
    ),
]
SpeedOption = Annotated[
    str | None,
    typer.Option(
        "--speed",
        help="Time scale of the twin: 1, N or max.",
        metavar="1|N|max",
        show_default="1",
        rich_help_panel=_ROBOT,
    ),
]
PlannerOption = Annotated[
    str | None,
    typer.Option(
        "--planner",
        help="asynchronous, safe-height or supercover.",
        show_default="asynchronous",
        rich_help_panel=_ROBOT,
    ),
]
SeedOption = Annotated[
    int | None,
    typer.Option(
        "--seed",
        help="Of everything random: how the twin's pieces stand, sampled moves.",
        show_default="0",
        rich_help_panel=_ROBOT,
    ),
]
TwinControlOption = Annotated[
    Path | None,
    typer.Option(
        "--twin-control",
        help="The --control socket of the `kempelen twin` at --port: for its ground truth in the report.",
        rich_help_panel=_ROBOT,
    ),
]
CameraOption = Annotated[
    str | None,
    typer.Option(
        "--camera",
        help="Which camera looks: twin, uvc:0, realsense, kinect2, azure, recording:PATH.",
        show_default="the twin's on the twin",
        rich_help_panel=_ROBOT,
    ),
]
SensorOption = Annotated[
    str | None,
    typer.Option(
        "--sensor",
        envvar="KEMPELEN_SENSOR",
        help="camera, reed (the reed board; reed:PORT), or several: depth,reed. Moves are read off the "
        "board and checked there; none: everything is believed.",
        metavar="auto|camera|reed|none",
        show_default="auto",
        rich_help_panel=_ROBOT,
    ),
]
_ENGINE_HELP = "Path or name of an engine (UCI or xboard), cluster, or node:NAME on another machine."
_LEVEL_HELP = "1 (beginner) to 20, an Elo, maia-1500, adaptive, or full."
_MOVE_TIME_HELP = "Seconds for each engine move."
_AS_BEFORE = "as before"

EngineOption = Annotated[
    str | None,
    typer.Option("--engine", help=_ENGINE_HELP, show_default="the best at hand", rich_help_panel=_GAME),
]
LevelOption = Annotated[
    str | None, typer.Option("--level", help=_LEVEL_HELP, show_default="full", rich_help_panel=_GAME)
]
MoveTimeOption = Annotated[
    float | None,
    typer.Option("--move-time", help=_MOVE_TIME_HELP, show_default="1.0", rich_help_panel=_GAME),
]
BookOption = Annotated[
    str | None,
    typer.Option(
        "--book",
        help="Opening book: people, or a PolyGlot file.",
        metavar="people|PATH",
        show_default="none",
        rich_help_panel=_GAME,
    ),
]
PonderOption = Annotated[
    bool | None,
    typer.Option("--ponder", help="The engine thinks in your time, too.", rich_help_panel=_GAME),
]
OtherEngineOption = Annotated[
    str | None,
    typer.Option("--engine", help=_ENGINE_HELP, show_default=_AS_BEFORE, rich_help_panel=_GAME),
]
OtherLevelOption = Annotated[
    str | None, typer.Option("--level", help=_LEVEL_HELP, show_default=_AS_BEFORE, rich_help_panel=_GAME)
]
OtherMoveTimeOption = Annotated[
    float | None,
    typer.Option("--move-time", help=_MOVE_TIME_HELP, show_default=_AS_BEFORE, rich_help_panel=_GAME),
]
FenOption = Annotated[
    str | None,
    typer.Option(
        "--fen",
        help="Start from this position.",
        show_default="the usual one",
        rich_help_panel=_GAME,
    ),
]
ReportOption = Annotated[
    Path | None,
    typer.Option("--report", help="Write a report of the game to this file (JSON).", rich_help_panel=_FILES),
]
PlainOption = Annotated[
    bool,
    typer.Option(
        "--plain", help="Lines instead of a picture, for screen readers and logs.", rich_help_panel=_FILES
    ),
]

"""`kempelen arm`: what an arm is, where it reaches, how it moves, where to put the board."""

from pathlib import Path
from typing import Annotated

import typer

from kempelen.cli.options import ConfigOption

arm = typer.Typer(
    name="arm",
    no_args_is_help=True,
)

_Name = Annotated[
    str,
    typer.Option(
        "--arm", help="An arm that Kempelen knows, or a parameter file (.toml).", metavar="NAME|FILE"
    ),
]
_Picture = Annotated[Path | None, typer.Option("--picture", help="Draw it: an SVG file.")]
_Most = Annotated[float, typer.Option("--most", help="Greatest tilt of the gripper, degrees.", min=0, max=90)]
_Surface = Annotated[
    float,
    typer.Option("--surface", help="Height of the board above the arm's foot, mm.", min=-1000, max=1000),
]
_DEFAULT = "labvolt-5150"


@arm.callback()
def _about() -> None:
    """Look at an arm: its numbers, its reach, its paths, the best place for a board.

    Examples:

        kempelen arm show
        kempelen arm place --square 35 --picture place.svg
    """


@arm.command()
def show(name: _Name = _DEFAULT) -> None:
    """Show the numbers of an arm, and where each comes from.

    Examples:

        kempelen arm show
        kempelen arm show --arm so-101
        kempelen arm show --arm my-arm.toml
    """
    from kempelen.cli.arm_run import show_arm

    show_arm(name)


@arm.command()
def workspace(name: _Name = _DEFAULT, picture: _Picture = None, most: _Most = 60.0) -> None:
    """Tell how far the tool reaches at each height, and draw the surface around it.

    Examples:

        kempelen arm workspace --picture workspace.svg
    """
    from kempelen.cli.arm_run import show_workspace

    show_workspace(name, picture, most)


@arm.command()
def paths(name: _Name = _DEFAULT, picture: _Picture = None) -> None:
    """Drive the two test paths of the 5150: all joints together, and guided along the line.

    Examples:

        kempelen arm paths --picture paths.svg
    """
    from kempelen.cli.arm_run import show_paths

    show_paths(name, picture)


@arm.command()
def place(
    name: _Name = _DEFAULT,
    square: Annotated[float, typer.Option("--square", help="Side of a square, mm.", min=5, max=200)] = 35.0,
    surface: _Surface = 66.0,
    lift: Annotated[
        float, typer.Option("--lift", help="How high pieces are lifted off the board, mm.", min=0, max=500)
    ] = 80.0,
    most: _Most = 60.0,
    picture: _Picture = None,
) -> None:
    """Find the best place for a board before an arm, and the largest board that it can serve.

    Examples:

        kempelen arm place --square 35 --picture place.svg
        kempelen arm place --arm so-101 --square 25 --surface 10
    """
    from kempelen.cli.arm_run import show_place

    show_place(name, picture, square=square, surface=surface, lift=lift, most=most)


@arm.command()
def grasp(
    tilts: Annotated[
        list[float] | None,
        typer.Option(
            "--tilt",
            help="Of the gripper, degrees; may be repeated.",
            min=-60,
            max=60,
            show_default="0, 15, 30",
        ),
    ] = None,
    picture: _Picture = None,
    config: ConfigOption = None,
) -> None:
    """Find how far the gripper may be off each kind of piece and still take it, by trying it out in physics.

    Across: along the closing axis. Inwards, outwards: towards the arm's base, away from it.

    Examples:

        kempelen arm grasp
        kempelen arm grasp --tilt 0 --tilt 10 --picture grasp.svg
    """
    from kempelen.cli.arm_grasp import show_margins

    show_margins(tuple(tilts or (0.0, 15.0, 30.0)), picture, config)

"""`kempelen calibrate`: where the board is, from touched corners."""

from pathlib import Path
from typing import Annotated

import typer

from kempelen.cli.options import ConfigOption, DataDirOption, Edge, PortOption, RobotOption


def calibrate_board(
    corner: Annotated[
        list[str] | None, typer.Option("--corner", help="A measured corner: a1=X,Y,Z (two to four of them).")
    ] = None,
    corners: Annotated[int, typer.Option("--corners", min=2, max=4, help="How many corners to touch.")] = 4,
    square: Annotated[
        float | None, typer.Option("--square", help="Side of a square, mm, when it is known.")
    ] = None,
    camera: Annotated[
        bool, typer.Option("--camera", help="Find out where the camera stands over the robot.")
    ] = False,
    source: Annotated[
        str | None,
        typer.Option(
            "--source", help="Which camera: twin, uvc:0, realsense, …", show_default="the configured one"
        ),
    ] = None,
    white: Annotated[
        Edge | None,
        typer.Option(
            "--white", help="Where White sits in the camera's picture.", show_default="told by the pieces"
        ),
    ] = None,
    arm: Annotated[
        bool, typer.Option("--arm", help="Find out how an arm differs from its parameter file.")
    ] = False,
    points: Annotated[
        Path | None,
        typer.Option("--points", help="For --arm: lines of x, y, z (mm on the board), joints (degrees)."),
    ] = None,
    show: Annotated[bool, typer.Option("--show", help="Show the calibration that is in force.")] = False,
    robot: RobotOption = None,
    port: PortOption = None,
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
) -> None:
    """Measure where the board is: touch its corners with the closed fingers.

    With --camera, measure where the camera stands instead; the board's corners must have been touched, and
    the pieces stand as at a game's start. A board that is bumped later is measured by the camera alone.
    With --arm, twelve points of the board tell the arm's joints and links, and where it stands.
    A game in progress is kept: end it with Ctrl-C, calibrate, resume.

    Examples:

        kempelen calibrate --port /dev/ttyUSB0
        kempelen calibrate --corner a1=150,25,0 --corner h1=550,25,0
        kempelen calibrate --camera --source realsense
        kempelen calibrate --arm --robot arm
        kempelen calibrate --show
    """
    from kempelen.cli import corners as work
    from kempelen.cli import start

    settings = start.configured(
        config, robot__kind=robot, robot__port=port, camera__source=source, data__dir=data_dir
    )
    if show:
        work.show(settings.calibration_path)
    elif arm:
        from kempelen.cli import calibrate_arm

        calibrate_arm.measure(settings, points)
    elif camera:
        from kempelen.cli import calibrate_camera

        calibrate_camera.measure(settings, white.value if white else "")
    else:
        work.measure(settings, corner or [], corners, square)

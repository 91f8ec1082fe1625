"""`kempelen see`: what the camera sees, and what is made of it."""

from pathlib import Path
from typing import Annotated

import typer

from kempelen.cli.options import CameraOption, ConfigOption, DataDirOption, Edge, SensorOption


def see(
    image: Annotated[Path | None, typer.Option("--image", help="Read this picture, and end.")] = None,
    depth: Annotated[
        Path | None,
        typer.Option("--depth", help="Depth picture registered to --image (16-bit PNG, mm)."),
    ] = None,
    white: Annotated[
        Edge | None,
        typer.Option("--white", help="Where White sits in --image.", show_default="told by the pieces"),
    ] = None,
    camera: CameraOption = None,
    sensor: SensorOption = None,
    png: Annotated[
        Path | None, typer.Option("--png", help="Write the annotated view to this file, and end.")
    ] = None,
    fen: Annotated[
        str | None,
        typer.Option("--fen", help="What stands on the board.", show_default="the start position"),
    ] = None,
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", help="Override a parameter: --set hand.above=140. May be repeated."),
    ] = None,
    once: Annotated[bool, typer.Option("--once", help="Show one view, and end.")] = False,
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
) -> None:
    """See what the camera sees: board, squares, heights, hand, likelihoods; or what the reed board feels.

    While it shows, type NAME=VALUE to override a parameter, NAME= to give it back, q to end.

    Examples:

        kempelen see                                the twin's camera
        kempelen see --camera realsense --png view.png
        kempelen see --sensor reed                  the reed board's switches
        kempelen see --image board.jpg              position and FEN of a photo
        kempelen see --image board.jpg --depth board-depth.png --white bottom
    """
    from kempelen.cli import see_reed, see_run, start

    settings = start.configured(config, camera__source=camera, sensor__kind=sensor, data__dir=data_dir)
    if image is not None:
        see_run.see_image(image, depth, white.value if white else None, png)
    elif settings.felt_only:
        see_reed.see_reed(settings, fen, once=once)
    else:
        see_run.see_camera(settings, fen, png, see_run.numbers(overrides or []), once=once)

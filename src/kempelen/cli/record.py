"""`kempelen record`: what a camera sees, on disk."""

from pathlib import Path
from typing import Annotated

import typer

from kempelen.cli.options import ConfigOption


def record(
    out: Annotated[
        Path, typer.Option("--out", "-o", help="Folder to make, or one file if its name ends in .zip.")
    ],
    camera: Annotated[
        str, typer.Option("--camera", help="uvc:0, realsense, kinect2, azure, ring:NAME, twin, …")
    ] = "twin",
    seconds: Annotated[
        float | None, typer.Option("--seconds", help="How long.", min=0.0, show_default="until Ctrl-C")
    ] = None,
    frames: Annotated[
        int | None, typer.Option("--frames", help="How many frames.", min=1, show_default="no limit")
    ] = None,
    jpeg: Annotated[
        bool, typer.Option("--jpeg", help="Colour as JPEG: a tenth of the size, and not lossless.")
    ] = False,
    config: ConfigOption = None,
) -> None:
    """Record a camera: colour, depth, times and calibration.

    What was recorded is kept, however it ends. Play it with --camera recording:PATH.

    Examples:

        kempelen record --camera realsense --out game.zip
        kempelen record --camera uvc:0 --out clip --seconds 20 --jpeg
    """
    from kempelen.cli.record_run import run_record

    run_record(camera, out, seconds, frames, jpeg=jpeg, config=config)

"""`kempelen jog`: drive the machine by hand."""

from typing import Annotated

import typer

from kempelen.cli.options import ConfigOption, PortOption, RobotOption, SpeedOption


def jog(
    to: Annotated[
        tuple[float, float, float] | None,
        typer.Option("--to", help="Drive to X Y Z (mm, straight line) and end.", metavar="X Y Z"),
    ] = None,
    robot: RobotOption = None,
    port: PortOption = None,
    speed: SpeedOption = None,
    config: ConfigOption = None,
) -> None:
    """Drive the machine by hand, with the live position.

    Arrows move x and y, Page Up and Page Down z, + and - change the speed; the machine stops when the key is
    let go.

    Examples:

        kempelen jog --port /dev/ttyUSB0
        kempelen jog --to 150 25 60
    """
    import asyncio

    from kempelen.cli import pad, start

    settings = start.configured(config, robot__kind=robot, robot__port=port, twin__speed=speed)
    if to is None:
        pad.need_terminal("Use: kempelen jog --to X Y Z")
    asyncio.run(pad.jog(settings, to))

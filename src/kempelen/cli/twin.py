"""`kempelen twin`: the simulated robot on its own, for any program that speaks its language."""

from pathlib import Path
from typing import Annotated

import typer

from kempelen.cli.options import ConfigOption, FenOption, RobotOption


def twin(
    wire: Annotated[
        str, typer.Option(help="pty, or tcp:PORT on this machine (tcp:0: any free port).")
    ] = "pty",
    link: Annotated[
        Path | None, typer.Option(help="Keep a symbolic link to the pseudo-terminal here.")
    ] = None,
    speed: Annotated[str, typer.Option(help="Time scale: 1, N or max.", metavar="1|N|max")] = "1",
    fen: FenOption = None,
    seed: Annotated[
        int, typer.Option(help="How the pieces stand off centre, and how clumsy the person is.", min=0)
    ] = 0,
    state: Annotated[Path | None, typer.Option(help="Keep the table here between runs.")] = None,
    keep: Annotated[bool, typer.Option("--keep", help="Go on from --state instead of setting up.")] = False,
    control: Annotated[
        Path | None, typer.Option(help="Side door for reports and tests: path of a Unix socket.")
    ] = None,
    robot: RobotOption = None,
    config: ConfigOption = None,
) -> None:
    """Run the physics twin: a virtual controller, the robot and all the pieces.

    Examples:

        kempelen twin --link /tmp/gantry      then: kempelen play --port /tmp/gantry
        kempelen twin --wire tcp:2300 --speed max
        kempelen twin --robot arm --link /tmp/arm          then: kempelen play --robot arm --port /tmp/arm
    """
    from kempelen.cli.twin_run import run_twin

    run_twin(
        config, robot, fen, speed, control, wire=wire, link=str(link or ""), seed=seed,
        state=str(state or ""), resume=keep,
    )  # fmt: skip

"""`kempelen doctor` and `kempelen config`."""

import typer

from kempelen.cli.options import ConfigOption, DataDirOption, EngineOption, PortOption, RobotOption


def doctor(
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
    robot: RobotOption = None,
    port: PortOption = None,
    engine: EngineOption = None,
) -> None:
    """Check engine, ports, permissions, physics, calibration and disk, and say what to do.

    Examples:

        kempelen doctor
        kempelen doctor --port /dev/ttyUSB0
        kempelen doctor --robot arm
    """
    import asyncio

    from kempelen.cli.checkup import checkup

    overrides = {
        "data.dir": str(data_dir) if data_dir else None,
        "robot.kind": robot,
        "robot.port": port,
        "engine.path": engine,
    }
    if asyncio.run(checkup(config, overrides)):
        raise typer.Exit(1)


def config(robot: RobotOption = None) -> None:
    """Print every setting with its default and meaning.

    Table, pieces and gripper have other defaults for an arm.

    Examples:

        kempelen config > kempelen.toml
        kempelen config --robot arm > arm.toml
    """
    from kempelen.app.config_example import example_toml

    typer.echo(example_toml(robot))

"""`kempelen doctor` and `kempelen config`."""

import typer

from kempelen.cli.options import ConfigOption, DataDirOption, EngineOption, PortOption


def doctor(
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
    port: PortOption = None,
    engine: EngineOption = None,
) -> None:
    """Check engine, ports, permissions, physics, calibration and disk, and say what to do.

    Examples:

        kempelen doctor
        kempelen doctor --port /dev/ttyUSB0
    """
    import asyncio

    from kempelen.cli.checkup import checkup

    overrides = {"data.dir": str(data_dir) if data_dir else None, "robot.port": port, "engine.path": engine}
    if asyncio.run(checkup(config, overrides)):
        raise typer.Exit(1)


def config() -> None:
    """Print every setting with its default and meaning.

    Examples:

        kempelen config > kempelen.toml
    """
    from kempelen.app.config_example import example_toml

    typer.echo(example_toml())

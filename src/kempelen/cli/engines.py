"""`kempelen engines`: which programs can play here."""

import typer


def engines() -> None:
    """List the engines found on this machine, and try each of them.

    Examples:

        kempelen engines
        kempelen play --engine fairymax
    """
    import asyncio

    from kempelen.cli.engines_run import show
    from kempelen.engines.probe import probe_all

    if not show(asyncio.run(probe_all())):
        raise typer.Exit(1)

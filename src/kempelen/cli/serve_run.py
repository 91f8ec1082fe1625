"""Runs the server from the terminal."""

import asyncio
import os
import sys
import threading
import webbrowser
from collections.abc import Mapping, Sequence

from rich.console import Console

from kempelen.app.config import NODE_PORT, Config
from kempelen.cli.trouble import told_of_warnings
from kempelen.server.commands import Role
from kempelen.server.run import Opened, ServeOptions, serve


def run(
    config: Config,
    *,
    host: str,
    port: int | None,
    tls: bool,
    passwords: Mapping[Role, str],
    names: Sequence[str],
    browser: bool,
) -> None:
    """Until it is ended.

    Raises:
        KempelenError: it cannot be served.
    """
    console = Console(soft_wrap=True, highlight=False)
    options = ServeOptions(
        host=host,
        port=port,
        tls=tls,
        passwords={role: password for role, password in passwords.items() if password},
        names=frozenset(names),
        connect=config.on_twin or config.robot.port.startswith(NODE_PORT),
    )

    def opened(where: Opened) -> None:
        _tell(console, where)
        if browser and _has_display():
            threading.Thread(target=webbrowser.open, args=(where.url,), daemon=True).start()

    with told_of_warnings(lambda text: console.print(text, markup=False, style="yellow")):
        game = asyncio.run(serve(config, options, opened))
    kept = "" if game is None else f" Game {game} is kept: go on with it in the page, after kempelen serve."
    console.print(f"The robot is at rest.{kept}")


def _tell(console: Console, where: Opened) -> None:
    """On lines of their own, so that they can be clicked and copied."""
    console.print("Kempelen's page, for you (this link works once):")
    console.print(f"  {where.url}", markup=False)
    if where.others:
        console.print("For those who look on:")
    for other in where.others:
        console.print(f"  {other}/spectator", markup=False)
    if where.fingerprint:
        console.print("The certificate was made here: a browser asks once whether to trust it. SHA-256:")
        console.print(f"  {where.fingerprint}", markup=False)
    if where.exposed:
        console.print("Passwords go over the network in the clear: use --tls.", style="yellow")
    console.print("More links: kempelen remote link    End: Ctrl-C")


def _has_display() -> bool:
    """Whether a browser can open a window; one in the terminal would be in the way."""
    if sys.platform in {"darwin", "win32"}:
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))

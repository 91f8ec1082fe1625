"""`kempelen node keys`: makes and lists the keys of a hall's machines."""

import typer
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from kempelen.app.config import Config
from kempelen.app.node_keys import Held, all_keys, keys_folder, make_keys
from kempelen.core.errors import ConfigError
from kempelen.nodes.rules import ROLES


def make(config: Config, role: str, name: str, days: int) -> None:
    """One machine's; tells where they are and what to do with them.

    Raises:
        ConfigError: as `make_keys`.
    """
    held = make_keys(keys_folder(config.data_dir), role, name, days)
    typer.echo(f"Keys of {held.machine}, which {ROLES[role].about}, valid until {held.until:%Y-%m-%d}:")
    typer.echo(f"  {held.folder}")
    typer.echo("Copy this folder to its machine by a safe way, and name it there with --keys.")
    typer.echo("The authority beside it stays here: whoever has ca.key can make keys.")


def show_keys(config: Config, *, asked: bool) -> None:
    """All that were made here.

    Raises:
        ConfigError: there are none, or a file is damaged.
    """
    where = keys_folder(config.data_dir)
    found = list(all_keys(where))
    if not found:
        raise ConfigError(
            f"There are no keys in {where}.", hint=f"Make some: kempelen node keys --role {'|'.join(ROLES)}"
        )
    Console().print(keys_table(found))
    if not asked:
        typer.echo(f"More keys: kempelen node keys NAME --role {'|'.join(ROLES)}")


def keys_table(found: list[Held]) -> Table:
    """A row for each machine."""
    shown = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in ("Machine", "Role", "Valid until", "State", "SHA-256"):
        shown.add_column(heading, overflow="fold")
    for held in found:
        state = Text("good", style="green")
        if held.trouble:
            state = Text(held.trouble, style="bold red")
        elif held.soon:
            state = Text("ends soon", style="yellow")
        shown.add_row(held.machine, held.role, f"{held.until:%Y-%m-%d}", state, f"{held.fingerprint[:23]}…")
    return shown

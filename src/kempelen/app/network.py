"""From the configuration to the network; what speaks on it is loaded when a game wants it."""

import re
from pathlib import Path
from typing import TYPE_CHECKING

from kempelen.app.config import Config
from kempelen.core.errors import ConfigError
from kempelen.nodes.link import Link

if TYPE_CHECKING:
    from kempelen.nodes.zenoh_link import Network

_NAME = re.compile(r"[a-z0-9][a-z0-9-]{0,31}")


def network_of(config: Config) -> "Network":
    """How the others are found.

    Raises:
        LinkError: nobody would accept this machine's keys.
        ConfigError: they are missing or damaged.
    """
    from kempelen.nodes.zenoh_link import Network  # noqa: PLC0415

    wanted = config.network
    keys = Path(wanted.keys).expanduser() if wanted.keys else None
    if keys is not None:
        from kempelen.app.node_keys import require_good  # noqa: PLC0415

        require_good(keys)
    return Network(connect=wanted.connect, listen=wanted.listen, discover=wanted.discover, keys=keys)


def link_of(config: Config) -> Link:
    """This program's way to the others, to be entered; raises as `network_of`."""
    from kempelen.nodes.zenoh_link import ZenohLink  # noqa: PLC0415

    return ZenohLink(network_of(config))


def table_name(text: str) -> str:
    """A table's name, as it is used in keys.

    Raises:
        ConfigError: it is none.
    """
    if not _NAME.fullmatch(text):
        raise ConfigError(
            f"'{text}' is no name for a table.",
            hint="Use 1 to 32 small letters, digits and hyphens: hall-3",
        )
    return text

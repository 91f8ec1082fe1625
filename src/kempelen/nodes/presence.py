"""Who offers what on the network, and what to say where nobody offers what is wanted."""

import asyncio
from contextlib import suppress
from dataclasses import dataclass

from kempelen.core.errors import EngineError, LinkError
from kempelen.nodes.link import Link
from kempelen.nodes.messages import PROTOCOL, key_of

_ENGINE = "engine"


@dataclass(frozen=True, slots=True)
class Presence:
    """What is seen of one kind of node.

    Attributes:
        what: ``robot``, ``board``, ``camera`` or ``engine``.
        name: Of the table, or of the engine, that is wanted.
        here: Names under which such a node of this protocol version is seen.
        foreign: Other versions of the protocol that the wanted one speaks.
    """

    what: str
    name: str
    here: tuple[str, ...]
    foreign: tuple[str, ...]

    @property
    def found(self) -> bool:
        """Whether the wanted one is there and can be spoken with."""
        return self.name in self.here

    def absence(self, seconds: float) -> LinkError | EngineError:
        """Why there is nothing to work with, and what to do.

        Args:
            seconds: It was looked for so long.
        """
        kind = EngineError if self.what == _ENGINE else LinkError
        wanted, option = f"at table {self.name}", "--table"
        if self.what == _ENGINE:
            wanted, option = f"named {self.name}", "--name"
        if self.foreign:
            return kind(
                f"The {self.what} node {wanted} speaks protocol {', '.join(self.foreign)}, this program "
                f"protocol {PROTOCOL}.",
                hint="Install the same version of Kempelen on both machines.",
            )
        return kind(
            f"No {self.what} node {wanted} answers within {seconds:.0f} s.",
            hint=f"Nodes with a{'n' if self.what == _ENGINE else ''} {self.what}: "
            f"{', '.join(self.here) or 'none'}. "
            f"Start one on its machine: kempelen node {self.what} {option} {self.name}",
        )


async def presence(link: Link, what: str, name: str) -> Presence:
    """Look who is there now.

    Args:
        link: Entered.
        what: Kind of node.
        name: Of the table, or of the engine.
    """
    keys = [key.split("/") for key in await link.standing(key_of("*", what, protocol="*"))]
    ours = str(PROTOCOL)
    return Presence(
        what,
        name,
        here=tuple(sorted({table for _, version, table, _ in keys if version == ours})),
        foreign=tuple(sorted({version for _, version, table, _ in keys if table == name} - {ours})),
    )


async def found_within(link: Link, what: str, name: str, seconds: float) -> Presence:
    """Wait until the wanted one is there, or so long.

    Args:
        link: Entered; it is watched until it is left.
        what: Kind of node.
        name: Of the table, or of the engine.
        seconds: At most.
    """
    came = asyncio.Event()

    def changed(_key: str, there: bool) -> None:  # noqa: FBT001 - the signature of a watch
        if there:
            came.set()

    await link.watch(key_of(name, what), changed)
    with suppress(TimeoutError):
        async with asyncio.timeout(seconds):
            await came.wait()
    return await presence(link, what, name)

"""The part of the configuration that says how programs on several machines find each other."""

from typing import Annotated

from pydantic import Field

from kempelen.app.config_pieces import Section


class NetworkConfig(Section):
    """How programs on several machines find each other.

    Attributes:
        connect: Endpoints of others beyond this network: "tcp/10.0.0.5:7447", "tls/robot.example:7447".
        listen: Own endpoints; empty for any free port, which others on the same network find by themselves.
        discover: Whether others on the same network are looked for.
        keys: Folder of this machine's keys, of `kempelen node keys`; empty: nobody is asked who they are.
        table: Name under which a game's state is told to whoever looks over the hall; empty: it is not told.
    """

    connect: Annotated[tuple[str, ...], Field(max_length=32)] = ()
    listen: Annotated[tuple[str, ...], Field(max_length=8)] = ()
    discover: bool = True
    keys: Annotated[str, Field(max_length=1000)] = ""
    table: Annotated[str, Field(max_length=32, pattern=r"^([a-z0-9][a-z0-9-]*)?$")] = ""

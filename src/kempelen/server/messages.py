"""What goes over the WebSocket, both ways."""

from typing import Annotated, Literal

from pydantic import Field

from kempelen.server.commands import AnyCommand, Reply, Role
from kempelen.server.model import Model
from kempelen.server.topics import TopicName, Topics


class Say(Model):
    """Something happened, in words for people: for a log, a live region, a voice.

    Attributes:
        kind: Name of the event of `kempelen.core.events` behind it, or ``note``.
        text: One sentence, in English; pages that know ``kind`` say it in their own language from ``data``.
        data: Of the event, by name: ``san``, ``square``, ``piece``, ``result``, ``reason`` …
        at: Server time, s since the epoch.
    """

    kind: str
    text: str
    data: dict[str, str | int | float | bool | None] = Field(default_factory=dict)
    at: float


class WireLine(Model):
    """A line on the robot's wire.

    Attributes:
        way: ``out`` to the robot, ``in`` from it.
    """

    number: int
    at: float
    way: Literal["out", "in"]
    text: str


class Snapshot(Model):
    """Everything that the client follows, now: the first message, and again to one that lagged.

    Attributes:
        epoch: Of this run of the server: numbers of another one mean nothing.
        sequence: Of the newest change in it.
        at: Server time, s since the epoch, for clocks.
    """

    type: Literal["snapshot"] = "snapshot"
    epoch: str
    sequence: int
    at: float
    role: Role
    topics: Topics
    said: tuple[Say, ...] = ()


class Delta(Model):
    """Topics that changed since the last message, whole; null where there is nothing any more.

    Attributes:
        changed: Names of those that ``topics`` holds; all others are null there, and mean nothing.
        moved_at: Server time of the oldest change in it, s since the epoch.
    """

    type: Literal["delta"] = "delta"
    sequence: int
    moved_at: float
    changed: tuple[TopicName, ...]
    topics: Topics
    said: tuple[Say, ...] = ()
    wire: tuple[WireLine, ...] = ()


class Replied(Model):
    """The answer to a command that came over this socket."""

    type: Literal["reply"] = "reply"
    reply: Reply


class Refused(Model):
    """A message could not be understood or is not allowed; the socket stays open unless it goes on so."""

    type: Literal["refused"] = "refused"
    error: str
    hint: str = ""


Down = Annotated[Snapshot | Delta | Replied | Refused, Field(discriminator="type")]


class Follow(Model):
    """Which topics to send; the server answers with a snapshot.

    Attributes:
        topics: Names; those that the role may not see are left out.
        wire: Whether to send lines of the robot's wire (operators).
    """

    type: Literal["follow"]
    topics: tuple[TopicName, ...]
    wire: bool = False


class Ask(Model):
    """A command."""

    type: Literal["command"]
    command: AnyCommand


Up = Annotated[Follow | Ask, Field(discriminator="type")]

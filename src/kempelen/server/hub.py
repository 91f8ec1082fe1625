"""Topics to clients: nobody waits for anybody, and a slow client skips values rather than piling them up.

A client has no queue. It has a set of names of topics that changed since its last message, and how far it got
in the ring of things said. When it can take a message, one is built from the newest values; the text of a
value is made once per change, and that of a message once for all clients that lack the same.
"""

import asyncio
import json
import time
from collections import deque
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import get_args

from pydantic import BaseModel

from kempelen.server.commands import Role
from kempelen.server.messages import Say, WireLine
from kempelen.server.topics import ClientsView, TopicName

BEAT_S = 0.06
"""Topics that flow are sent at most this often."""
FLOWING: frozenset[TopicName] = frozenset({"robot", "squares", "thinking"})  # the scene has a pace of its own
TOPICS: tuple[TopicName, ...] = get_args(TopicName)
_FOR_OPERATORS: frozenset[TopicName] = frozenset({"calibration", "clients"})

SAID_KEPT = 256
_SAID_IN_SNAPSHOT = 50
_POSTED = 64
WIRE_KEPT = 2000
_WIRE_IN_MESSAGE = 400

Value = BaseModel | Sequence[BaseModel] | None


def may_see(role: Role, topic: TopicName) -> bool:
    """Whether a topic is for this role."""
    return role == "operator" or topic not in _FOR_OPERATORS


def _text(value: Value) -> str:
    if value is None:
        return "null"
    if isinstance(value, BaseModel):
        return value.model_dump_json()
    return _array(item.model_dump_json() for item in value)


def _array(texts: Iterable[str]) -> str:
    return f"[{','.join(texts)}]"


@dataclass(slots=True)
class _Topic:
    """A value and its texts, made when first wanted.

    Attributes:
        version: Counts its changes.
        whole: The value itself, where ``value`` says only what changed.
        moved_at: When it changed last, s since the epoch.
    """

    value: Value = None
    whole: Value = None
    version: int = 0
    moved_at: float = 0.0
    text: str | None = None
    whole_text: str | None = None

    def change(self) -> str:
        if self.text is None:
            self.text = _text(self.value)
        return self.text

    def everything(self) -> str:
        if self.value is self.whole:
            return self.change()
        if self.whole_text is None:
            self.whole_text = _text(self.whole)
        return self.whole_text


class _Ring:
    """The newest texts, numbered from 1."""

    def __init__(self, kept: int) -> None:
        self._texts: deque[str] = deque(maxlen=kept)
        self.last = 0

    def add(self, text: str) -> None:
        self._texts.append(text)
        self.last += 1

    def lost(self, seen: int) -> bool:
        """Whether something after ``seen`` is gone."""
        return self.last - seen > len(self._texts)

    def after(self, seen: int, most: int | None = None) -> list[str]:
        """Those after number ``seen``, the newest ``most`` of them."""
        count = min(self.last - seen, len(self._texts), most if most is not None else self.last)
        return list(islice(self._texts, len(self._texts) - count, None))


class Client:
    """One page. Made by `Hub.join`.

    Attributes:
        role: What it may see.
    """

    def __init__(self, hub: "Hub", role: Role) -> None:
        self.role: Role = role
        self._hub = hub
        self._news = asyncio.Event()
        self._topics: frozenset[TopicName] = frozenset()
        self._wire = False
        self._following = self._snapshot = False
        self._seen: dict[TopicName, int] = {}
        self._changed: set[TopicName] = set()
        self._since = 0.0
        self._said = 0
        self._lines = 0
        self._posted: deque[str] = deque(maxlen=_POSTED)

    def follow(self, topics: Iterable[TopicName], *, wire: bool = False) -> None:
        """Other topics from now on; a snapshot comes next. Those that its role may not see are left out."""
        self._topics = frozenset(topic for topic in topics if may_see(self.role, topic))
        self._wire = wire and self.role == "operator"
        self._following = self._snapshot = True
        self._news.set()

    def follows(self, topic: TopicName) -> bool:
        """Whether it gets this one."""
        return topic in self._topics

    async def next(self) -> str:
        """The next message, as soon as there is something to tell."""
        while True:
            await self._news.wait()
            if self._posted:
                return self._posted.popleft()
            self._news.clear()
            if (message := self._message()) is not None:
                return message

    def post(self, message: str) -> None:
        """A message for it alone; the oldest is dropped where it takes none of many."""
        self._posted.append(message)
        self._news.set()

    # --- called by the hub ----------------------------------------------------------------------------------

    def mark(self, topic: TopicName, moved_at: float) -> None:
        """A topic has changed."""
        if topic in self._topics:
            if not self._changed:
                self._since = moved_at
            self._changed.add(topic)

    def wake(self, *, wire: bool = False) -> None:
        """Now is the time to send what has changed."""
        if self._changed or self._said < self._hub.said.last or (wire and self._wire):
            self._news.set()

    # --- messages -------------------------------------------------------------------------------------------

    def _message(self) -> str | None:
        hub = self._hub
        if not self._following:
            return None
        if self._snapshot or hub.said.lost(self._said):
            self._snapshot = False
            self._caught_up()
            self._lines = hub.wire.last
            return hub.snapshot(self.role, self._topics)
        message = self._delta()
        self._caught_up()
        return message

    def _delta(self) -> str | None:
        hub = self._hub
        changed = tuple(
            (topic, hub.version(topic) == self._seen[topic] + 1)
            for topic in TOPICS
            if topic in self._changed and hub.version(topic) != self._seen[topic]
        )
        lines = hub.wire.after(self._lines, _WIRE_IN_MESSAGE) if self._wire else []
        self._lines = hub.wire.last
        if not changed and not lines and self._said == hub.said.last:
            return None
        moved_at = self._since if changed else hub.now()
        return hub.delta(changed, moved_at, self._said, lines)

    def _caught_up(self) -> None:
        self._changed.clear()
        self._seen = {topic: self._hub.version(topic) for topic in self._topics}
        self._said = self._hub.said.last


class Hub:
    """The newest value of every topic, and who follows which. Used from one event loop.

    Args:
        epoch: Names this run of the server.
        clock: s since the epoch.
        beat: Least time between messages about topics that flow, s.

    Attributes:
        said: What was said.
        wire: Lines of the robot's wire.
    """

    def __init__(self, epoch: str, *, clock: Callable[[], float] = time.time, beat: float = BEAT_S) -> None:
        self.said = _Ring(SAID_KEPT)
        self.wire = _Ring(WIRE_KEPT)
        self.now = clock
        self._epoch = epoch
        self._beat = beat
        self._sequence = 0
        self._topics: Mapping[TopicName, _Topic] = {name: _Topic() for name in TOPICS}
        self._clients: set[Client] = set()
        self._built: dict[object, str] = {}
        self._due: asyncio.TimerHandle | None = None
        self._count()

    # --- what is shown --------------------------------------------------------------------------------------

    def put(self, topic: TopicName, value: Value, *, whole: Value = None) -> None:
        """A topic has this value from now on; nothing happens when it had it before.

        Args:
            topic: Its name.
            value: For clients that have the value before it.
            whole: For all others, where ``value`` says only what changed.
        """
        kept = self._topics[topic]
        whole = value if whole is None else whole
        if kept.value == value and kept.whole == whole:
            return
        kept.value, kept.whole, kept.text, kept.whole_text = value, whole, None, None
        kept.version += 1
        kept.moved_at = self.now()
        self._moved()
        for client in self._clients:
            client.mark(topic, kept.moved_at)
        self._tell(at_once=topic not in FLOWING)

    def get(self, topic: TopicName) -> Value:
        """What it is, whole."""
        return self._topics[topic].whole

    def version(self, topic: TopicName) -> int:
        """How often it has changed."""
        return self._topics[topic].version

    def say(self, said: Say) -> None:
        """Something happened."""
        self.said.add(said.model_dump_json())
        self._moved()
        self._tell(at_once=True)

    def line(self, line: WireLine) -> None:
        """Something went over the robot's wire."""
        self.wire.add(line.model_dump_json())
        self._tell(at_once=False)

    def _moved(self) -> None:
        self._sequence += 1
        self._built.clear()

    def _tell(self, *, at_once: bool) -> None:
        if at_once:
            for client in self._clients:
                client.wake()
        elif self._due is None and self._clients:
            self._due = asyncio.get_running_loop().call_later(self._beat, self._on_beat)

    def _on_beat(self) -> None:
        self._due = None
        for client in self._clients:
            client.wake(wire=True)

    # --- clients --------------------------------------------------------------------------------------------

    def join(self, role: Role) -> Client:
        """A new client. It gets nothing before it follows something, and must be let go of with `leave`."""
        client = Client(self, role)
        self._clients.add(client)
        self._count()
        return client

    def followed(self, topic: TopicName) -> bool:
        """Whether anybody wants to know."""
        return any(client.follows(topic) for client in self._clients)

    @property
    def clients(self) -> int:
        """How many there are."""
        return len(self._clients)

    def leave(self, client: Client) -> None:
        """It is gone; nothing is kept of it."""
        self._clients.discard(client)
        if not self._clients and self._due is not None:
            self._due.cancel()
            self._due = None
        self._count()

    def _count(self) -> None:
        roles = [client.role for client in self._clients]
        self.put(
            "clients",
            ClientsView(
                operators=roles.count("operator"),
                players=roles.count("player"),
                spectators=roles.count("spectator"),
            ),
        )

    # --- messages -------------------------------------------------------------------------------------------

    def snapshot(self, role: Role, topics: Collection[TopicName]) -> str:
        """A `Snapshot` of these topics, as JSON."""
        texts = ((name, self._topics[name].everything() if name in topics else "null") for name in TOPICS)
        said = self.said.after(0, _SAID_IN_SNAPSHOT)
        return (
            f'{{"type":"snapshot","epoch":{json.dumps(self._epoch)},"sequence":{self._sequence},'
            f'"at":{self.now():.4f},"role":"{role}","topics":{_object(texts)},"said":{_array(said)}}}'
        )

    def delta(
        self, changed: Sequence[tuple[TopicName, bool]], moved_at: float, said_before: int, lines: list[str]
    ) -> str:
        """A `Delta`, as JSON; the same text for all that lack the same.

        Args:
            changed: Names, and whether the client has the value before.
            moved_at: When the oldest change happened.
            said_before: Number of the newest thing said that the client knows.
            lines: Of the wire.
        """
        key = (changed, moved_at, said_before, self.said.last)
        if not lines and (built := self._built.get(key)) is not None:
            return built
        texts = dict.fromkeys(TOPICS, "null") | {
            name: self._topics[name].change() if has_last else self._topics[name].everything()
            for name, has_last in changed
        }
        message = (
            f'{{"type":"delta","sequence":{self._sequence},"moved_at":{moved_at:.4f},'
            f'"changed":{_array(json.dumps(name) for name, _ in changed)},"topics":{_object(texts.items())},'
            f'"said":{_array(self.said.after(said_before))},"wire":{_array(lines)}}}'
        )
        if not lines:
            self._built[key] = message
        return message


def _object(texts: Iterable[tuple[str, str]]) -> str:
    return f"{{{','.join(f'{json.dumps(name)}:{text}' for name, text in texts)}}}"

"""A robot at another machine's node, as a `kempelen.core.protocols.Robot` like any other."""

import asyncio
import getpass
import itertools
import platform
import time
import uuid
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Self

from pydantic import ValidationError

from kempelen.core.errors import KempelenError, LinkError, MotionError
from kempelen.core.protocols import Action, RobotState
from kempelen.core.table import WorkSpace
from kempelen.nodes.link import Link
from kempelen.nodes.messages import (
    Beat,
    Call,
    Deed,
    News,
    Outcome,
    Take,
    Taken,
    action_message,
    key_of,
)
from kempelen.nodes.presence import presence

_FAREWELLS = 3
"""Times that leaving is tried to be told."""


@dataclass(frozen=True)
class Waits:
    """How long the arbiter's side waits, s.

    Attributes:
        answer: For one answer.
        again: After none, before it asks again.
        news: For the end of a command, before it asks after it.
        beat: Between two signs of life.
        valid: A command is not begun later than this after it was sent.
        found: For a node, at first.
        lost: Without any answer: then the node counts as gone.
    """

    answer: float = 0.5
    again: float = 0.05
    news: float = 0.25
    beat: float = 0.15
    valid: float = 1.0
    found: float = 5.0
    lost: float = 20.0


class RemoteRobot:
    """Implements `kempelen.core.protocols.Robot`. Async context manager, entered inside of its link.

    A cut link is waited out: the node holds the robot meanwhile, and the command that was under way goes on
    when the link is there again. A command has one number however often it is sent, so that it is carried out
    once.

    Args:
        link: Entered.
        table: At which the robot stands.
        who: Leads it, for people.
        waits: How long for what.
        clock: s.
    """

    def __init__(
        self,
        link: Link,
        table: str,
        *,
        who: str = "",
        waits: Waits | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.name = table
        self.space = WorkSpace()
        self._link = link
        self._table = table
        self._take = Take(client=uuid.uuid4().hex, who=who or _myself())
        self._waits = waits or Waits()
        self._clock = clock
        self._lease = ""
        self._ahead = 0.0  # of the node's clock before this one's, at least
        self._heard = 0.0
        self._newest = 0
        self._numbers = itertools.count(1)
        self._state = RobotState(message="It is not connected.")
        self._changed = asyncio.Event()
        self._ends: dict[int, asyncio.Event] = {}
        self._beats: asyncio.Task[None] | None = None
        self._gone: KempelenError | None = None

    # --- coming and going -----------------------------------------------------------------------------------

    async def __aenter__(self) -> Self:
        """Find the node and take the robot.

        Raises:
            LinkError: no node of this protocol is there for the table; the message says what is.
            BusyError: another arbiter has the robot.
        """
        await self._link.listen(key_of(self._table, "robot", "news"), self._hear)
        taken = await self._taken()
        if taken.trouble is not None:
            raise taken.trouble.error()
        self.name, self.space = taken.name, taken.space or WorkSpace()
        self._lease, self._gone, self._newest, self._ahead = taken.lease, None, 0, 0.0
        self._reached(taken.clock, taken.state)
        self._beats = asyncio.create_task(self._beat())
        return self

    async def _taken(self) -> Taken:
        deadline = self._clock() + self._waits.found
        while True:
            sent = self._clock()
            try:
                content = await self._link.ask(
                    key_of(self._table, "robot", "take"), self._take.pack(), seconds=self._waits.answer
                )
            except LinkError:
                if self._clock() > deadline:
                    seen = await presence(self._link, "robot", self._table)
                    raise seen.absence(self._waits.found) from None
                await asyncio.sleep(max(self._waits.answer - (self._clock() - sent), 0.0))
                continue
            return Taken.unpack(content)

    async def __aexit__(self, *exc: object) -> None:
        """Bring the machine to rest and let go of it."""
        if self._beats is not None:
            self._beats.cancel()
            await asyncio.gather(self._beats, return_exceptions=True)
            await self._leave()
            self._lose(self._gone or LinkError("The robot was let go of.", hint="Connect again."))
        self._lease = ""
        self._now(RobotState(message="It is not connected."))

    async def _leave(self) -> None:
        """The node brings the robot to rest; if it cannot be told, it finds out by itself."""
        last = Beat(lease=self._lease, leaves=True).pack()
        for _ in range(_FAREWELLS if self._gone is None else 0):
            with suppress(LinkError):
                await self._link.ask(key_of(self._table, "robot", "beat"), last, seconds=self._waits.answer)
                return

    # --- what is known --------------------------------------------------------------------------------------

    @property
    def state(self) -> RobotState:
        """The latest that was heard."""
        return self._state

    async def watch(self) -> AsyncIterator[RobotState]:
        """Each new snapshot, until it is left; a slow reader skips to the newest."""
        shown: RobotState | None = None
        while self._lease or self._state != shown:
            if self._state == shown:
                await self._changed.wait()
            else:
                shown = self._state
                yield shown

    def _now(self, state: RobotState) -> None:
        if state != self._state:
            self._state = state
            changed, self._changed = self._changed, asyncio.Event()
            changed.set()

    def _hear(self, _key: str, content: bytes) -> None:
        with suppress(LinkError):
            news = News.unpack(content)
            if news.lease == self._lease and news.count > self._newest and self._lease:
                self._newest = news.count
                self._reached(news.clock, news.state)
                if (end := self._ends.get(news.finished)) is not None:
                    end.set()

    def _reached(self, clock: float, state: RobotState | None) -> None:
        now = self._clock()
        self._heard = now
        self._ahead = max(self._ahead, clock - now) if self._ahead else clock - now
        if state is not None:
            self._now(state)

    async def _beat(self) -> None:
        """Tell the node that its arbiter is there, for as long as the node is."""
        key, beat = key_of(self._table, "robot", "beat"), Beat(lease=self._lease).pack()
        while True:
            try:
                outcome = Outcome.unpack(await self._link.ask(key, beat, seconds=self._waits.answer))
                if outcome.trouble is not None:
                    self._lose(outcome.trouble.error())
                    return
                self._reached(outcome.clock, outcome.state)
            except LinkError:
                silent = self._clock() - self._heard
                if silent > self._waits.lost:
                    self._lose(
                        LinkError(
                            f"The robot node at table {self._table} has not answered for {silent:.0f} s.",
                            hint="Look after its machine and the network; then: kempelen resume",
                        )
                    )
                    return
                waiting = f"The network is cut, for {silent:.0f} s now; the robot waits where it is."
                self._now(replace(self._state, message=waiting))
            await asyncio.sleep(self._waits.beat)

    def _lose(self, error: KempelenError) -> None:
        self._gone = error
        self._now(RobotState(message=str(error.message)))
        for end in self._ends.values():
            end.set()

    # --- commands -------------------------------------------------------------------------------------------

    async def home(self) -> None:
        """Find the reference switches."""
        await self._motion("home")

    async def run(self, group: Sequence[Action]) -> None:
        """Carry out an atomic group; raises what the robot raises."""
        await self._motion("run", group)

    async def retract(self) -> None:
        """Straight up."""
        await self._motion("retract")

    async def recover(self) -> None:
        """Clear an alarm, a stop or a lost line."""
        await self._call("recover")

    async def hold(self) -> None:
        """Decelerate now; returns at rest."""
        await self._call("hold")

    async def resume(self) -> None:
        """Go on after `hold`."""
        await self._call("resume")

    async def cancel(self) -> None:
        """Hold, then drop the rest of the group."""
        await self._call("cancel")

    async def stop(self) -> None:
        """E-stop: sent until it is answered, ahead of everything."""
        await self._call("stop")

    async def jog(self, direction: tuple[float, float, float], speed: float) -> None:
        """Keep moving; a keep-alive."""
        await self._call("jog", direction=direction, speed=speed)

    async def jog_stop(self) -> None:
        """End jogging; returns at rest."""
        await self._call("jog_stop")

    async def _motion(self, deed: Deed, group: Sequence[Action] = ()) -> None:
        """A command that is cancelled at the node when it is cancelled here; returns at rest."""
        try:
            await self._call(deed, group)
        except asyncio.CancelledError:
            with suppress(KempelenError):
                await self._call("cancel")
            raise

    async def _call(
        self,
        deed: Deed,
        group: Sequence[Action] = (),
        direction: tuple[float, float, float] = (0.0, 0.0, 0.0),
        speed: float = 0.0,
    ) -> None:
        if not self._lease:
            raise LinkError("The robot is not connected.", hint="Connect first.")
        try:
            call = Call(
                lease=self._lease, number=next(self._numbers), valid_until=0.0, deed=deed,
                group=tuple(action_message(action) for action in group), direction=direction, speed=speed,
            )  # fmt: skip
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            raise MotionError(
                f"'{deed}' cannot be sent: {'.'.join(map(str, first['loc']))}: {first['msg']}.",
                hint="All positions, times and speeds must be finite numbers.",
            ) from None
        end = self._ends[call.number] = asyncio.Event()
        try:
            outcome = await self._ended(call, end)
        finally:
            del self._ends[call.number]
        if outcome.trouble is not None:
            raise outcome.trouble.error()

    async def _ended(self, call: Call, end: asyncio.Event) -> Outcome:
        """Ask until there is an answer, then until the command has ended."""
        while True:
            outcome = await self._asked(call)
            if outcome is not None and outcome.status != "running" and not outcome.late:
                return outcome
            if outcome is not None and outcome.status == "running":
                with suppress(TimeoutError):
                    async with asyncio.timeout(self._waits.news):
                        await end.wait()
                end.clear()

    async def _asked(self, call: Call) -> Outcome | None:
        if self._gone is not None:
            raise self._gone
        valid = self._clock() + self._ahead + self._waits.valid
        question = call.model_copy(update={"valid_until": valid}).pack()
        try:
            content = await self._link.ask(
                key_of(self._table, "robot", "do"), question, seconds=self._waits.answer
            )
            outcome = Outcome.unpack(content)
        except LinkError:
            await asyncio.sleep(self._waits.again)
            return None  # asked again, until the beats give the node up
        self._reached(outcome.clock, outcome.state)
        return outcome


def _myself() -> str:
    return f"{getpass.getuser()} at {platform.node()}"

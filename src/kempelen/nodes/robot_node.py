"""The node beside a robot: one arbiter at a time, no command late or twice, at rest when it is left alone."""

import asyncio
import itertools
import logging
import time
import uuid
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Self

from kempelen.core.errors import BusyError, KempelenError, LinkError
from kempelen.core.protocols import Robot, RobotPhase, RobotState
from kempelen.nodes.link import Link
from kempelen.nodes.messages import (
    Beat,
    Call,
    Deed,
    News,
    Outcome,
    Take,
    Taken,
    Trouble,
    action_of,
    key_of,
)

_log = logging.getLogger(__name__)
_KEPT = 64
"""Commands whose outcome is remembered, for whoever asks again."""
_AT_ONCE_S = 0.02
"""A command that ends within this is answered with its end."""
_ALL: tuple[Deed, ...] = ("home", "run", "retract", "hold", "resume", "recover", "jog", "jog_stop")
_OVERTAKES: Mapping[Deed, tuple[Deed, ...]] = {
    "stop": (*_ALL, "cancel"),
    "cancel": _ALL,
    "hold": ("resume", "jog"),
    "resume": ("hold",),
    "jog_stop": ("jog",),
}
_AT_HOLD = frozenset({RobotPhase.HOLDING, RobotPhase.HELD})
_MOVING = frozenset({RobotPhase.MOVING, RobotPhase.HOMING, RobotPhase.JOGGING})


@dataclass(frozen=True)
class Patience:
    """How long the node waits for a silent arbiter, s.

    Attributes:
        rest: Then the robot is brought to rest, in mid-motion if need be, and keeps what it holds.
        forfeit: Then another arbiter may take it.
        look: How often it looks.
    """

    rest: float = 0.6
    forfeit: float = 5.0
    look: float = 0.05


@dataclass
class _Lease:
    """An arbiter's right to the robot."""

    name: str
    take: Take
    heard: float
    highest: int = 0
    held: bool = False  # by the node, because its arbiter fell silent
    void: dict[Deed, int] = field(default_factory=dict)  # what has not begun before this number never does


class RobotNode:
    """Offers a robot at a table. Async context manager, entered inside of the robot and the link.

    Args:
        robot: Entered.
        link: Entered.
        table: Its name in the hall.
        patience: With silent arbiters.
        clock: s.
    """

    def __init__(
        self,
        robot: Robot,
        link: Link,
        table: str,
        *,
        patience: Patience | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.robot = robot
        self._link = link
        self._table = table
        self._patience = patience or Patience()
        self._clock = clock
        self._lease: _Lease | None = None
        self._served = False
        self._count = itertools.count(1)
        self._calls: OrderedDict[int, asyncio.Task[Trouble | None]] = OrderedDict()
        self._chores: list[asyncio.Task[None]] = []
        self._taking = asyncio.Lock()

    async def __aenter__(self) -> Self:
        """Be found."""
        for word, answer in (("take", self._take), ("beat", self._beat), ("do", self._do)):
            await self._link.answer(key_of(self._table, "robot", word), answer)
        self._chores = [asyncio.create_task(self._tell_states()), asyncio.create_task(self._watch_over())]
        await self._link.stand(key_of(self._table, "robot"))
        return self

    async def __aexit__(self, *exc: object) -> None:
        """Robot at rest, nobody's any more."""
        for task in (*self._chores, *self._calls.values()):
            task.cancel()
        await asyncio.gather(*self._chores, *self._calls.values(), return_exceptions=True)

    @property
    def arbiter(self) -> str:
        """Who has the robot, for people; empty for nobody."""
        return self._lease.take.who if self._lease else ""

    # --- who has it -----------------------------------------------------------------------------------------

    async def _take(self, content: bytes) -> bytes:
        try:
            take = Take.unpack(content)
            async with self._taking:
                lease = await self._granted(take)
        except KempelenError as error:
            return Taken(clock=self._clock(), trouble=Trouble.of(error)).pack()
        robot = self.robot
        return Taken(
            lease=lease.name, clock=self._clock(), name=robot.name, space=robot.space, state=self._state()
        ).pack()

    async def _granted(self, take: Take) -> _Lease:
        """The lease of whoever asks.

        Raises:
            BusyError: another arbiter has the robot, and is heard of.
        """
        now, before = self._clock(), self._lease
        if before is not None and before.take.client == take.client:
            before.heard = now
            return before
        if before is not None:
            silent = now - before.heard
            if silent < self._patience.forfeit:
                raise BusyError(
                    f"The robot at table {self._table} is led by {before.take.who}, "
                    f"heard of {silent:.1f} s ago.",
                    hint="End that program, or wait until it has been silent for "
                    f"{self._patience.forfeit:.0f} s.",
                )
            _log.warning("%s has been silent for too long: the robot is free", before.take.who)
            await self._drop()
        lease = self._lease = _Lease(uuid.uuid4().hex, take, self._clock())
        return lease

    async def _drop(self) -> None:
        """What the arbiter had begun ends here, at rest; the gripper keeps what it holds."""
        lease = self._lease
        if any(not task.done() for task in self._calls.values()):
            await self.robot.cancel()
            await asyncio.gather(*self._calls.values(), return_exceptions=True)
        elif (lease is not None and lease.held) or self.robot.state.phase in _AT_HOLD:
            await self._let_go_on()
        self._calls.clear()
        self._lease, self._served = None, True

    async def _let_go_on(self) -> None:
        """Nothing is left that could move; but a robot that is still held would let the next arbiter wait."""
        try:
            await self.robot.resume()
        except KempelenError as error:
            _log.warning("The robot stays held: %s", error)

    def _state(self) -> RobotState:
        """The robot's, whose memory this node has kept while arbiters came and went."""
        state = self.robot.state
        return replace(state, memory_kept=True) if self._served else state

    async def _beat(self, content: bytes) -> bytes:
        try:
            beat = Beat.unpack(content)
            lease = self._owner(beat.lease)
            if beat.leaves:
                async with self._taking:
                    await self._drop()
        except KempelenError as error:
            return Outcome(
                number=0,
                status="refused",
                clock=self._clock(),
                state=self._state(),
                trouble=Trouble.of(error),
            ).pack()
        if not beat.leaves:
            await self._heard(lease)
        return Outcome(number=0, status="done", clock=self._clock(), state=self._state()).pack()

    def _owner(self, name: str) -> _Lease:
        if self._lease is None or self._lease.name != name:
            raise LinkError(
                f"The robot at table {self._table} no longer knows this program: "
                + (f"{self.arbiter} has taken it." if self._lease else "its node was started again."),
                hint="Go on with the game: kempelen resume",
            )
        return self._lease

    async def _heard(self, lease: _Lease) -> None:
        """The arbiter is there again: what the node itself has held goes on."""
        lease.heard = self._clock()
        if lease.held:
            lease.held = False
            await self.robot.resume()

    async def _watch_over(self) -> None:
        """Bring the robot to rest when its arbiter has fallen silent."""
        while True:
            await asyncio.sleep(self._patience.look)
            lease = self._lease
            if lease is None or lease.held or self._clock() - lease.heard < self._patience.rest:
                continue
            if self.robot.state.phase in _MOVING:
                lease.held = True
                _log.warning("%s has fallen silent: the robot is held", lease.take.who)
                try:
                    await self.robot.hold()
                except KempelenError as error:
                    _log.warning("It could not be held: %s", error)

    # --- commands -------------------------------------------------------------------------------------------

    async def _do(self, content: bytes) -> bytes:
        number = 0
        try:
            call = Call.unpack(content)
            number = call.number
            if call.deed == "stop" and (self._lease is None or self._lease.name != call.lease):
                await self.robot.stop()  # safe from anybody, at any time
                return self._outcome(number, "done").pack()
            lease = self._owner(call.lease)
            await self._heard(lease)
            if number not in self._calls:
                if (refusal := self._refusal(lease, call)) is not None:
                    return refusal.pack()
                self._begin(lease, call)
            return (await self._so_far(number)).pack()
        except KempelenError as error:
            return self._outcome(number, "refused", Trouble.of(error)).pack()

    def _refusal(self, lease: _Lease, call: Call) -> Outcome | None:
        overtaken = max(lease.void.get(call.deed, 0), lease.highest - _KEPT)
        if call.number <= overtaken:
            error = LinkError(f"Command {call.number} was overtaken by command {overtaken}.")
            return self._outcome(call.number, "refused", Trouble.of(error))
        late = self._clock() - call.valid_until
        if late > 0 and call.deed != "stop":
            error = LinkError(f"Command {call.number} came {late:.2f} s too late; nothing was done.")
            return self._outcome(call.number, "refused", Trouble.of(error), late=True)
        return None

    def _begin(self, lease: _Lease, call: Call) -> None:
        self._overtake(lease, call)
        self._calls[call.number] = asyncio.create_task(self._carried_out(call))
        while len(self._calls) > _KEPT and next(iter(self._calls.values())).done():
            self._calls.popitem(last=False)

    @staticmethod
    def _overtake(lease: _Lease, call: Call) -> None:
        """What this command would undo must not come after it."""
        lease.highest = max(lease.highest, call.number)
        for deed in _OVERTAKES.get(call.deed, ()):
            lease.void[deed] = max(lease.void.get(deed, 0), call.number)

    async def _carried_out(self, call: Call) -> Trouble | None:
        try:
            await self._deed(call)
        except KempelenError as error:
            return Trouble.of(error)
        finally:
            await self._link.tell(key_of(self._table, "robot", "news"), self._news(call.number).pack())
        return None

    async def _deed(self, call: Call) -> None:
        robot = self.robot
        match call.deed:
            case "run":
                await robot.run([action_of(action) for action in call.group])
            case "jog":
                await robot.jog(call.direction, call.speed)
            case _:
                await getattr(robot, call.deed)()

    async def _so_far(self, number: int) -> Outcome:
        task = self._calls[number]
        await asyncio.wait({task}, timeout=_AT_ONCE_S)
        if not task.done():
            return self._outcome(number, "running")
        if task.cancelled():
            return self._outcome(number, "failed", Trouble.of(LinkError("The robot's node is ending.")))
        trouble = task.result()
        return self._outcome(number, "failed" if trouble else "done", trouble)

    def _outcome(
        self, number: int, status: str, trouble: Trouble | None = None, *, late: bool = False
    ) -> Outcome:
        return Outcome.model_validate(
            {
                "number": number,
                "status": status,
                "clock": self._clock(),
                "state": self._state(),
                "trouble": trouble,
                "late": late,
            }
        )

    # --- news -----------------------------------------------------------------------------------------------

    def _news(self, finished: int = 0) -> News:
        lease = self._lease.name if self._lease else ""
        return News(
            count=next(self._count), clock=self._clock(), state=self._state(), lease=lease, finished=finished
        )

    async def _tell_states(self) -> None:
        async for _ in self.robot.watch():
            await self._link.tell(key_of(self._table, "robot", "news"), self._news().pack())

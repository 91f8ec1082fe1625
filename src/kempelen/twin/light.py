"""A table without physics, for halls full of them: a tool point that takes its time, pieces that go along."""

import asyncio
from collections.abc import AsyncIterator, Coroutine, Sequence
from dataclasses import replace
from typing import Any, Self

import chess
import numpy as np

from kempelen.core.errors import BusyError, MotionError, NotHomedError, StoppedError
from kempelen.core.places import Layout, Place
from kempelen.core.protocols import Action, Follow, FollowJoints, GripperState, RobotPhase, RobotState
from kempelen.core.table import Table

_REACH = 0.4
"""A gripper closes on a piece whose place is no farther away than this share of a square."""

_SLICE_S = 0.25
"""After so long at most it is looked whether the robot is held, or has another pace, s."""


class LightTable:
    """What stands where, and what the gripper did to it.

    Args:
        table: Where places are.
        layout: What stands where at first.

    Attributes:
        held: The piece in the gripper.
        carried: Times that a piece was let go elsewhere than where it was taken.
        faults: What must never happen, in words: a piece let go on another one, or beside every place.
    """

    def __init__(self, table: Table, layout: Layout) -> None:
        self._places = table.places
        self._centres = np.array([table.centre(place)[:2] for place in table.places])
        self._near = _REACH * table.square
        self.standing = dict(layout)
        self.held: chess.Piece | None = None
        self._taken_from: Place | None = None
        self.carried = 0
        self.faults: list[str] = []

    @property
    def layout(self) -> Layout:
        """What stands where; a piece in the gripper counts nowhere."""
        return Layout(self.standing)

    def close(self, point: tuple[float, float, float]) -> None:
        """The gripper closes at a tool point, mm, robot frame."""
        place = self._place(point)
        if self.held is None and place is not None and place in self.standing:
            self.held, self._taken_from = self.standing.pop(place), place

    def open(self, point: tuple[float, float, float]) -> None:
        """It opens."""
        if self.held is None:
            return
        place, piece = self._place(point), self.held
        self.held = None
        if place is None or place in self.standing:
            self.faults.append(
                f"{piece.symbol()} was let go {f'on {place}' if place else 'beside all places'}"
            )
            return
        self.standing[place] = piece
        self.carried += place != self._taken_from

    def _place(self, point: tuple[float, float, float]) -> Place | None:
        away = np.hypot(*(self._centres - np.array(point[:2])).T)
        nearest = int(away.argmin())
        return self._places[nearest] if away[nearest] <= self._near else None


class LightRobot:
    """Implements `kempelen.core.protocols.Robot` over a `LightTable`.

    Args:
        table: Its work space is the robot's.
        world: What the gripper takes and sets down.
        pace: Seconds of motion for each second of the clock.

    Attributes:
        pace: As given; may be changed.
    """

    name = "light"

    def __init__(self, table: Table, world: LightTable, *, pace: float = 1.0) -> None:
        self.space = table.space
        self._world = world
        self.pace = pace
        self._top = (self.space.lower[0], self.space.lower[1], self.space.upper[2])
        self._state = RobotState()
        self._changed = asyncio.Event()
        self._work: asyncio.Task[None] | None = None
        self._free = asyncio.Event()

    # --- coming and going -----------------------------------------------------------------------------------

    async def __aenter__(self) -> Self:
        """It has just been switched on."""
        self._free.set()
        self._be(RobotPhase.LOCKED, message="Home it first.")
        return self

    async def __aexit__(self, *exc: object) -> None:
        """At rest."""
        await self._end_work()
        self._be(RobotPhase.DISCONNECTED, homed=False)

    @property
    def state(self) -> RobotState:
        """The latest snapshot."""
        return self._state

    async def watch(self) -> AsyncIterator[RobotState]:
        """Each new snapshot, until it is left."""
        shown: RobotState | None = None
        while self._state.phase is not RobotPhase.DISCONNECTED or self._state != shown:
            if self._state == shown:
                await self._changed.wait()
            else:
                shown = self._state
                yield shown

    def _be(self, phase: RobotPhase, **changes: object) -> None:
        self._state = replace(self._state, phase=phase, **{"message": "", **changes})  # type: ignore[arg-type]
        changed, self._changed = self._changed, asyncio.Event()
        changed.set()

    # --- motion ---------------------------------------------------------------------------------------------

    async def home(self) -> None:
        """To the corner, at the top; the gripper stays as it is."""
        self._must_be_free()
        self._be(RobotPhase.HOMING)
        await self._while_working(self._pass(1.0))
        self._be(RobotPhase.IDLE, homed=True, reported_position=self._top)

    async def run(self, group: Sequence[Action]) -> None:
        """Carry out an atomic group."""
        self._must_be_free()
        if not self._state.homed:
            raise NotHomedError("The robot was not homed.", hint="Home it first.")
        for action in group:
            self._check(action)
        if self._free.is_set():
            self._be(RobotPhase.MOVING)
        await self._while_working(self._all(group))
        self._be(RobotPhase.IDLE)

    def _check(self, action: Action) -> None:
        if isinstance(action, FollowJoints):
            raise MotionError("A light robot has no joints.", hint="Send it tool points.")
        if isinstance(action, Follow):
            for vertex in action.vertices:
                if (beyond := self.space.excess(vertex)) > 0.01:  # noqa: PLR2004 - a rounding, mm
                    raise MotionError(f"{vertex.round(3).tolist()} lies {beyond:.1f} mm outside.")

    async def _all(self, group: Sequence[Action]) -> None:
        for action in group:
            await self._pass(action.seconds)
            if isinstance(action, Follow):
                x, y, z = action.vertices[-1].tolist()
                self._be(self._state.phase, reported_position=(x, y, z))
            elif not isinstance(action, FollowJoints):
                self._grip(closed=action.closed)

    def _grip(self, *, closed: bool) -> None:
        here = self._state.reported_position or self._top
        (self._world.close if closed else self._world.open)(here)
        self._be(self._state.phase, gripper=GripperState.CLOSED if closed else GripperState.OPEN)

    async def _pass(self, seconds: float) -> None:
        """Let time go by, unless it is held; on a busy computer it goes by more slowly."""
        while seconds > 0:
            await self._free.wait()
            slice_s = min(seconds / self.pace, _SLICE_S)
            seconds -= slice_s * self.pace
            await asyncio.sleep(slice_s)
        await self._free.wait()

    def _must_be_free(self) -> None:
        if self._work is not None:
            raise BusyError("Another group is at work.", hint="Wait for its end.")

    async def _while_working(self, work: Coroutine[Any, Any, None]) -> None:
        self._work = task = asyncio.ensure_future(work)
        try:
            await asyncio.shield(task)
        except asyncio.CancelledError:
            if task.cancelled():
                raise StoppedError("The motion was ended.") from None
            await self.cancel()
            raise
        finally:
            self._work = None

    async def _end_work(self) -> None:
        if self._work is not None:
            self._work.cancel()
            await asyncio.wait({self._work})

    async def retract(self) -> None:
        """Straight up."""
        x, y, _ = self._state.reported_position or self._top
        way = np.array([self._state.reported_position or self._top, (x, y, self._top[2])])
        await self.run([Follow(way, 0.2)])

    async def hold(self) -> None:
        """At rest now; what is at work goes on after `resume`."""
        self._free.clear()
        if self._state.homed:
            self._be(RobotPhase.HELD)

    async def resume(self) -> None:
        """Go on."""
        if not self._free.is_set():
            self._free.set()
            self._be(RobotPhase.MOVING if self._work is not None else RobotPhase.IDLE)

    async def cancel(self) -> None:
        """Drop what is at work."""
        await self._end_work()
        self._free.set()
        if self._state.homed:
            self._be(RobotPhase.IDLE)

    async def stop(self) -> None:
        """E-stop."""
        await self._end_work()
        self._free.set()
        self._be(
            RobotPhase.LOCKED, homed=False, reported_position=None, message="It was stopped. Home it first."
        )

    async def recover(self) -> None:
        """Nothing to be cleared."""

    async def jog(self, direction: tuple[float, float, float], speed: float) -> None:
        """A light robot is not jogged.

        Raises:
            MotionError: always.
        """
        raise MotionError(f"A light robot cannot be jogged ({direction}, {speed} mm/s).")

    async def jog_stop(self) -> None:
        """Nothing to be ended."""

"""A machine under a controller of the GRBL family: the driver, whatever hangs on the axes.

A group of actions is compiled and checked as a whole, streamed by character counting, and believed done only
when a barrier has been acknowledged and a status report made after it says Idle *and* the target position.
"""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Self

from kempelen.core.errors import BusyError, LinkError, NotHomedError, RobotError, StoppedError
from kempelen.core.protocols import Action, RobotPhase, RobotState
from kempelen.robots.grbl import codec, homing
from kempelen.robots.grbl.codec import Axes, Event, Status
from kempelen.robots.grbl.condition import Condition
from kempelen.robots.grbl.connect import at_rest
from kempelen.robots.grbl.explain import alarm_error
from kempelen.robots.grbl.family import GRBL, Family
from kempelen.robots.grbl.gate import Gate
from kempelen.robots.grbl.gcode import GripperWiring
from kempelen.robots.grbl.jog import Jogger
from kempelen.robots.grbl.link import Link
from kempelen.robots.grbl.mechanics import Mechanics
from kempelen.robots.grbl.running import carry_out
from kempelen.robots.grbl.session import Session, finish
from kempelen.robots.grbl.timing import Timing
from kempelen.robots.grbl.watchdog import Watchdog
from kempelen.robots.transport import Transport


class GrblRobot:
    """Implements `kempelen.core.protocols.Robot`.

    Args:
        connect: Opens the port; called on entering and on recovering from a lost line.
        mechanics: What hangs on the axes.
        wiring: Of the gripper.
        timing: Patience.
        apply_settings: Send settings that do not fit instead of refusing them.
        family: How the controller talks.
    """

    def __init__(
        self,
        connect: Callable[[], Awaitable[Transport]],
        mechanics: Mechanics,
        *,
        wiring: GripperWiring | None = None,
        timing: Timing | None = None,
        apply_settings: bool = False,
        family: Family = GRBL,
    ) -> None:
        self._family = family
        self.name = mechanics.name
        self.space = mechanics.space
        self._mechanics = mechanics
        self._connect = connect
        self._wiring = wiring or GripperWiring()
        self._timing = timing or Timing()
        self._apply_settings = apply_settings
        self._condition = Condition(self._wiring, mechanics)
        self._open_session: Session | None = None
        self._watchdog: asyncio.Task[None] | None = None
        self._jogger: Jogger | None = None
        self._jogging: asyncio.Task[None] | None = None
        self._gate = Gate()

    # --- life -----------------------------------------------------------------------------------------------

    @property
    def state(self) -> RobotState:
        """The latest snapshot."""
        return self._condition.state

    def watch(self) -> AsyncIterator[RobotState]:
        """Each new snapshot; a slow reader skips to the newest."""
        return self._condition.watch()

    @property
    def damaged_lines(self) -> int:
        """How many lines arrived damaged since connecting: the quality of the line."""
        return self._open_session.link.damaged if self._open_session else 0

    async def __aenter__(self) -> Self:
        """Connect. Believes nothing: not homed, payload unknown.

        Raises:
            LinkError: no such port, no permission, in use, nobody answers, another device answers.
            SettingsError: the controller's settings do not fit; the message names each and its fix.
        """
        self._condition.closed = False
        await self._open()
        return self

    async def __aexit__(self, *_exc: object) -> None:
        """Bring the machine to rest and let go of the port."""
        await finish(self._close())

    async def _open(self) -> None:
        self._condition.forget()
        self._gate.reset()
        link = Link(await self._connect(), self._hear, self._condition.lost, self._family.framing())
        link.start()
        try:
            greeting = await self._family.greet(
                link, self._mechanics, self._wiring, self._timing, apply_settings=self._apply_settings
            )
            session = Session(link, self._condition, greeting, self._mechanics, self._wiring, self._timing)
            await session.begin()
        except BaseException:
            await finish(link.close())
            raise
        self._open_session = session
        self._watchdog = asyncio.create_task(Watchdog(session).run(), name=f"watchdog of the {self.name}")

    async def _close(self) -> None:
        try:
            if self._open_session is not None and self._open_session.link.lost is None:
                with suppress(RobotError):
                    await self.cancel()
        finally:
            await self._let_go()
            self._condition.closed = True
            self._condition.publish()

    async def _let_go(self) -> None:
        tasks = [task for task in (self._watchdog, self._jogging) if task is not None]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self._watchdog = self._jogging = self._jogger = None
        if self._open_session is not None:
            session, self._open_session = self._open_session, None
            await session.link.close()
        self._condition.connected = self._condition.homed = False

    def _hear(self, event: Event) -> None:
        if isinstance(event, Status) and self._open_session is not None:
            self._open_session.note_gripper()
        self._condition.hear(event)

    # --- one job at a time ----------------------------------------------------------------------------------

    @property
    def _session(self) -> Session:
        if self._open_session is None:
            raise LinkError(f"The {self.name} is not connected.", hint="Connect first.")
        if self._open_session.link.lost is not None:
            raise self._open_session.link.lost
        return self._open_session

    def _require_free(self, activity: str) -> Session:
        session, condition = self._session, self._condition
        if condition.activity or not self._gate.calm:
            raise BusyError(
                f"The {self.name} is busy ({condition.activity or 'stopping'}); '{activity}' was refused.",
                hint="Wait for it, or cancel it first.",
            )
        if condition.alarm is not None:
            raise alarm_error(condition.alarm, self.name)
        return session

    @contextmanager
    def _at_work(self, activity: str) -> Iterator[Session]:
        session = self._require_free(activity)
        self._gate.begin()
        self._condition.activity = activity
        self._condition.publish()
        try:
            yield session
        finally:
            self._condition.activity = ""
            self._condition.publish()

    def _here(self) -> Axes:
        position = self._condition.position
        if not self._condition.homed or position is None:
            raise NotHomedError(f"The {self.name} does not know where it is.", hint="Home it first.")
        return position

    # --- running a group ------------------------------------------------------------------------------------

    async def run(self, group: Sequence[Action]) -> None:
        """Carry out an atomic group; returns when the machine is physically at the end.

        Cancelled: the machine has come to rest (hold, then reset at rest) and keeps its position; the rest of
        the group is dropped.

        Raises:
            BusyError: another group is at work.
            NotHomedError: home first.
            StoppedError: `stop` or `cancel` ended it.
            AlarmError: the controller raised an alarm.
            LinkError: the line was lost or damaged a line; nothing is resent.
            MotionError: a vertex lies outside of the work space (nothing was sent).
        """
        with self._at_work("run") as session:
            program = self._mechanics.compile(group, self._here(), self._wiring)
            await self._gate.wait()
            await carry_out(session, program, self._gate)

    async def retract(self) -> None:
        """Straight up to the top of the work space.

        Raises:
            RobotError: as `run`.
        """
        with self._at_work("run") as session:
            program = self._mechanics.retract(self._here())
            await self._gate.wait()
            await carry_out(session, program, self._gate)

    # --- pause, cancel, stop --------------------------------------------------------------------------------

    async def hold(self) -> None:
        """Decelerate now, keeping the group; returns at rest. Between groups the next one waits.

        Homing cannot be paused: it is broken off, and begins anew after `resume`.

        Raises:
            LinkError: the line was lost.
            StoppedError: `stop` came first.
        """
        session, condition = self._session, self._condition
        self._gate.shut()
        condition.paused = True
        if condition.activity == "jog":
            await self.jog_stop()
        elif session.work is not None:
            session.link.realtime(codec.HOLD)
            await at_rest(session.link, self._timing)
        elif condition.activity == "home" and session.link.stream_at_work is not None:
            session.link.fail(homing.PausedError("Homing was paused."))
            await session.reset(keeps_position=False)
            condition.clear()
        elif condition.activity == "home":
            await at_rest(session.link, self._timing)
        condition.publish()

    async def resume(self) -> None:
        """Go on after `hold`, or after the safety door was closed.

        Raises:
            LinkError: the line was lost.
            StoppedError: `stop` came first.
        """
        session, phase = self._session, self._condition.phase
        if not (self._condition.paused or phase in {RobotPhase.HOLDING, RobotPhase.HELD}):
            return
        # The controller ignores a resume while it still slows down, and reports the hold once more after it.
        status = await at_rest(session.link, self._timing)
        while status.state in {"Hold", "Door"}:
            session.link.realtime(session.link.framing.resume)
            status = await session.link.ask(self._timing.answer)
            if status.state in {"Hold", "Door"}:
                await asyncio.sleep(self._timing.poll)
                status = await session.link.ask(self._timing.answer)
        self._open_gate()

    def _open_gate(self) -> None:
        self._condition.paused = False
        self._gate.open()
        self._condition.publish()

    async def cancel(self) -> None:
        """Hold, then drop the rest of the group; position is kept. `run` raises StoppedError.

        Raises:
            LinkError: the line was lost.
        """
        session, condition = self._session, self._condition
        if condition.activity == "jog":
            await self.jog_stop()
        if not (condition.activity or condition.paused):
            return
        on_the_wire = session.work is not None or (condition.status and condition.status.state == "Hold")
        homing_now = condition.activity == "home" and session.link.stream_at_work and not session.work
        self._end(session, StoppedError("The motion was cancelled.", hint="Plan again from where it is."))
        try:
            if homing_now:
                await session.reset(keeps_position=False)
            elif on_the_wire:
                await session.halt()
        finally:
            self._rested()

    async def stop(self) -> None:
        """E-stop: everything ends now; homing is needed afterwards. Never queues.

        Raises:
            LinkError: the line is lost: cut the power.
        """
        session = self._session
        mark = session.link.banners
        session.link.realtime(codec.HOLD + codec.RESET)  # before anything else
        session.note_gripper()
        error = StoppedError(f"The {self.name} was stopped.", hint="Recover, then home.")
        self._end(session, error)
        self._condition.homed = False
        if self._jogger is not None:
            self._jogger.end(error)
        try:
            await session.restarted(mark)
        finally:
            self._rested()

    def _end(self, session: Session, error: StoppedError) -> None:
        self._gate.end(error)
        session.link.interrupt(error)

    def _rested(self) -> None:
        self._gate.rested()
        self._open_gate()

    async def recover(self) -> None:
        """After an alarm, a stop or a lost line: clear it, so that `home` can follow.

        Raises:
            BusyError: something is still at work.
            LinkError: the line is still lost.
            SettingsError: as on connecting.
        """
        if self._open_session is None or self._open_session.link.lost is not None:
            await self._let_go()
            await self._open()
            return
        if self._condition.activity:
            raise BusyError(f"The {self.name} is busy ({self._condition.activity}).", hint="Stop it first.")
        await self._open_session.unlock()
        self._open_gate()

    # --- homing and jogging ---------------------------------------------------------------------------------

    async def home(self) -> None:
        """Find the reference switches; believed only when the controller proves it (see `homing`).

        Cancelled: the homing is broken off by a reset; the machine is at rest and not homed.

        Raises:
            BusyError: something is at work.
            AlarmError: a switch was not found, or an alarm must be recovered from first.
            StoppedError: `stop` or `cancel` ended it.
            LinkError: the line was lost.
        """
        with self._at_work("home") as session:
            await self._home(session)

    async def _home(self, session: Session) -> None:
        await homing.home(session, self._gate)

    async def jog(self, direction: tuple[float, float, float], speed: float) -> None:
        """Keep moving along ``direction`` at ``speed`` mm/s; a keep-alive: motion ends when the calls do.

        Raises:
            BusyError: a group is at work, or the machine is paused.
            NotHomedError: home first.
            MotionError: no direction or no speed.
            RobotError: the jog before ended badly.
        """
        if self._jogger is not None and self._condition.activity == "jog":
            self._jogger.keep(direction, speed)
            return
        await self._reap_jog()
        session = self._require_free("jog")
        if self._condition.paused:
            raise BusyError(f"The {self.name} is paused.", hint="Resume or cancel first.")
        jogger = Jogger(session.link, self._mechanics.jog(self._here()), self._timing)
        jogger.keep(direction, speed)
        self._jogger = jogger
        self._jogging = asyncio.create_task(self._jog(jogger), name="jog")
        await asyncio.sleep(0)

    async def _jog(self, jogger: Jogger) -> None:
        with self._at_work("jog"):
            await jogger.run()

    async def jog_stop(self) -> None:
        """End jogging; returns at rest.

        Raises:
            RobotError: the jog ended badly.
        """
        if self._jogger is not None:
            self._jogger.end()
        await self._reap_jog()

    async def _reap_jog(self) -> None:
        if self._jogging is not None:
            task = self._jogging
            try:
                await asyncio.shield(task)
            finally:
                if task.done():
                    self._jogging = self._jogger = None

"""The table of a station: connected, homed, jogged, stopped; held while nobody plays, lent to each game."""

import asyncio
import logging
from collections.abc import Callable, Coroutine, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any, TypeVar

import chess

from kempelen.app.config import TWIN_PORT, Config
from kempelen.app.config_change import changed, for_robot
from kempelen.app.game_run import GameRun
from kempelen.app.idle_table import IdleTable
from kempelen.app.jogging import JogDesk
from kempelen.app.live_game import LiveGame
from kempelen.app.station_faults import faults_of
from kempelen.app.station_types import Change, Phase, StationFault
from kempelen.app.table_session import TableSession, robot_kinds, twin_speed
from kempelen.core.errors import (
    BusyError,
    ConfigError,
    GameError,
    KempelenError,
    LinkError,
    StoppedError,
    TwinError,
)
from kempelen.core.places import Layout
from kempelen.core.protocols import Robot, RobotState
from kempelen.core.table import start_layout
from kempelen.core.words import joined, say
from kempelen.game.observers import EventBus
from kempelen.twin.client import Door

if TYPE_CHECKING:
    from kempelen.app.eyes import GameEyes

_log = logging.getLogger(__name__)

T = TypeVar("T")
_JOG_PACE = 1.0
"""Time scale of the twin while it is jogged, at most: keep-alives come on the wall's clock."""
Listener = Callable[[Change], None]


class StationTable:
    """What a station does without a game. See `kempelen.app.station.Station`."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._known = dict[str, Config]()  # by kind of robot, as last used
        self._idle: IdleTable | None = None
        self._run: GameRun | None = None
        self._listeners: list[Listener] = []
        self._work: asyncio.Task[Any] | None = None
        self._inner: asyncio.Task[Any] | None = None
        self._halted = False
        self._letting_go = False
        self._passing: Phase | None = None
        self._trouble: KempelenError | None = None
        self._jogs = JogDesk(lambda: self._pace(_JOG_PACE), lambda: self._pace(self.speed))
        self._watching: asyncio.Task[None] | None = None
        self._view: Door | None = None
        self._viewing = asyncio.Lock()
        self._faults: tuple[StationFault, ...] = ()
        self.events = EventBus()
        self.busy = ""

    # --- what is ---

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Call ``listener`` at once, in the loop, for whatever changes; it must be quick.

        Returns:
            How to end it.
        """
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener)

    def _tell(self, *changes: Change) -> None:
        for change in changes:
            for listener in tuple(self._listeners):
                try:
                    listener(change)
                except Exception:  # noqa: BLE001 - a fault of a view is never one of the table
                    _log.exception("A listener failed on %s", change)

    @property
    def phase(self) -> Phase:
        """What the station is doing."""
        if self._passing is not None:
            return self._passing
        if self._run is not None and self._run.running:
            return Phase.PLAYING
        return Phase.OFF if self.session is None else Phase.READY

    @property
    def config(self) -> Config:
        """In force, as overridden by `connect`, `set_speed` and `set_eye_parameter`."""
        return self._config

    @property
    def live(self) -> LiveGame | None:
        """The game on the table: running, over, or cut off; it stays until another begins or it is left."""
        return self._run.live if self._run is not None else None

    @property
    def playing(self) -> LiveGame | None:
        """The game that is being played; None when it is over or was cut off."""
        return self._run.live if self._run is not None and self._run.running else None

    @property
    def session(self) -> TableSession | None:
        """The table that is up, the game's or the station's own."""
        if self._run is not None:
            return self._run.live.session
        return self._idle.session if self._idle is not None else None

    @property
    def eyes(self) -> "GameEyes | None":
        """What looks at the board; None for nothing."""
        if self._run is not None:
            return self._run.live.eyes
        return self._idle.eyes if self._idle is not None else None

    @property
    def robot(self) -> RobotState:
        """The robot's latest state; one that is let go of says nothing more: its line closes as it should."""
        return self.session.robot.state if self.session is not None and self._connected else RobotState()

    @property
    def _connected(self) -> bool:
        return self.session is not None and not self._letting_go

    @property
    def standing(self) -> Layout:
        """What stands where: as the game has it, or as for the start."""
        if self.live is not None:
            return self.live.layout
        return start_layout(self.require_session().table, chess.Board())

    @property
    def speed(self) -> float:
        """The twin's time scale; 0 for as fast as it can."""
        return twin_speed(self._config)

    @property
    def faults(self) -> tuple[StationFault, ...]:
        """What is wrong, the gravest first; that a robot is let go of is nothing wrong."""
        return faults_of(
            self.robot if self._connected else None,
            playing=self.playing is not None or self._passing is not None,
            ended_by=self._run.error if self._run is not None else None,
            trouble=self._idle.trouble if self._idle is not None else self._trouble,
            eyes=self.eyes.trouble if self.eyes is not None else "",
        )

    def require_session(self) -> TableSession:
        """The table that is up.

        Raises:
            LinkError: no robot is connected.
        """
        if self.session is None:
            raise LinkError(
                say("not_connected", "No robot is connected."), hint=say("connect_one", "Connect one.")
            )
        return self.session

    async def truth(self) -> Mapping[str, Any] | None:
        """Twin: pieces, tool point, gripper and hand as they are; None without a twin, or when it is gone.

        Has a connection of its own, so that it never waits for the virtual person. Units are mm; ``pieces``
        have ``id``, ``kind`` (upper case), ``white``, ``x``, ``y``, ``z``, ``q`` (w, x, y, z), ``tilt``;
        ``tool`` is a point; ``closed``; ``hand`` is a point, or None when it is away.
        """
        async with self._viewing:
            control = self.session.control if self.session is not None else None
            if control is None:
                return None
            with suppress(TwinError):
                if self._view is None:
                    self._view = await control.beside().__aenter__()
                return await self._view.ask("truth")
        return None

    # --- one thing at a time ---

    async def _do(
        self, busy: str, work: Callable[[], Coroutine[Any, Any, T]], passing: Phase | None = None
    ) -> T:
        """Do what takes a while; it goes on when whoever asked for it goes away.

        Raises:
            BusyError: something else takes its while.
        """
        self._require_free()
        self.busy, self._passing, self._halted = busy, passing, False
        self._work = task = asyncio.ensure_future(self._until_done(work))
        task.add_done_callback(_heard)
        self._tell(Change.STATION)
        return await asyncio.shield(task)

    async def _until_done(self, work: Callable[[], Coroutine[Any, Any, T]]) -> T:
        try:
            return await work()
        finally:
            self.busy, self._passing, self._work = "", None, None
            self._tell(Change.STATION, Change.ROBOT, Change.GAME, Change.EYES)

    async def _interruptible(self, work: Coroutine[Any, Any, T], what: str) -> T:
        """The result of ``work``, unless an e-stop or the end comes first.

        Raises:
            StoppedError: it did.
        """
        self._inner = task = asyncio.ensure_future(work)
        if self._halted:
            task.cancel()
        try:
            return await task
        except asyncio.CancelledError:
            if (here := asyncio.current_task()) is None or here.cancelling():
                raise
            raise StoppedError(what, hint=say("begin_again", "Begin again.")) from None
        finally:
            self._inner = None

    def _require_free(self) -> None:
        if self._work is not None:
            raise BusyError(
                joined(say("not_now", "Not now:"), self.busy),
                hint=say("wait_done", "Wait until that is done."),
            )

    def _require_no_game(self) -> None:
        if self.playing is not None:
            raise GameError(
                say("being_played", "A game is being played."),
                hint=say("leave_first", "Leave it first; it is kept."),
            )

    # --- up and down ---

    async def connect(self, kind: str, port: str) -> None:
        """Connect a robot, or the same one again; a game that is over or was cut off is put away.

        Args:
            kind: Name of the driver.
            port: "twin", a device, or a socket.

        Raises:
            GameError: a game is being played.
            ConfigError: there is no such driver.
            KempelenError: it cannot be connected.
        """
        self._require_no_game()
        if kind not in robot_kinds():
            raise ConfigError(
                say("no_driver", f"There is no driver for a robot of kind '{kind}'.", kind=kind),
                hint=say(
                    "installed", f"Installed: {', '.join(robot_kinds())}.", kinds=", ".join(robot_kinds())
                ),
            )
        control = self._config.twin.control if port == self._config.robot.port else ""
        self._known[self._config.robot.kind] = self._config
        config = for_robot(self._config, kind, self._known.get(kind))
        config = changed(config, {"robot.port": port, "twin.control": control})
        busy = say("busy_connecting", f"Connecting {port} …", port=port)
        if port == TWIN_PORT:
            busy = say("busy_connecting_twin", "Connecting the twin …")
        await self._do(busy, lambda: self._connect(config), Phase.CONNECTING)

    async def _connect(self, config: Config) -> None:
        await self._put_away()
        self._config = config
        await self._set_up()

    async def change_table(self, config: Config) -> None:
        """Another table from now on: trays, pieces, squares; a robot that is connected is connected anew.

        Raises:
            GameError: a game is being played.
            KempelenError: it cannot be connected again.
        """
        self._require_no_game()
        if self.session is not None:
            await self._do(
                say("busy_table", "Setting up the table …"), lambda: self._connect(config), Phase.CONNECTING
            )
            return
        self._require_free()
        self._config = config
        self._tell(Change.STATION)

    async def disconnect(self) -> None:
        """Let go of the robot.

        Raises:
            GameError: a game is being played.
        """
        self._require_no_game()
        await self._do(say("busy_disconnecting", "Disconnecting …"), self._put_away)

    async def _set_up(self, *, look: bool = False) -> None:
        """A table of the station's own.

        Raises:
            KempelenError: there is none; the fault stays to be seen.
        """
        self._trouble = None
        table = IdleTable(self._config, look=look, tell=self._hear_eyes)
        try:
            self._idle = await self._interruptible(
                table.__aenter__(), say("connecting_stopped", "Connecting was stopped.")
            )
        except KempelenError as error:
            self._trouble = error
            raise
        self._attend(self._idle.session.robot)
        with suppress(KempelenError):
            home = self._home_own_twin(self._idle.session)
            await self._interruptible(home, say("homing_stopped", "Homing was stopped."))

    async def _home_own_twin(self, session: TableSession) -> None:
        """A machine is never homed without being asked; near our own twin nobody can be hurt.

        It takes no longer than it must.

        Raises:
            KempelenError: what goes wrong; as of any other homing it is a fault that is shown.
        """
        if session.twin is None or session.control is None:
            return
        await session.control.ask("speed", speed=0)
        try:
            await session.robot.home()
        finally:
            with suppress(KempelenError):
                await session.control.ask("speed", speed=self.speed)

    async def _pace(self, speed: float) -> None:
        """Twin: another time scale for a while; who jogs has to see the robot move, and stop it in time."""
        control = self.session.control if self.session is not None else None
        if control is not None and not 0 < self.speed <= _JOG_PACE:
            with suppress(TwinError):
                await control.ask("speed", speed=speed)

    async def _put_away(self) -> None:
        """The table of the game, or the station's own, with robot at rest."""
        self._trouble, self._letting_go = None, True
        try:
            await self._before_putting_away()
            if self._run is not None:
                await self._run.leave()
            if self._idle is not None:
                await self._idle.__aexit__(None, None, None)
        finally:
            self._run = self._idle = None
            self._letting_go = False
            self._tell(Change.ROBOT)
            await self._hang_up()

    async def _before_putting_away(self) -> None:
        """What else has to end."""
        with suppress(KempelenError):
            await self._jogs.stop_all()

    async def _hang_up(self) -> None:
        if self._watching is not None:
            self._watching.cancel()
            await asyncio.gather(self._watching, return_exceptions=True)
            self._watching = None
        async with self._viewing:
            view, self._view = self._view, None
            if view is not None:
                await view.__aexit__()

    def _attend(self, robot: Robot) -> None:
        """Tell what becomes of the robot."""
        self._watching = asyncio.create_task(self._watch(robot), name="robot watched")

    async def _watch(self, robot: Robot) -> None:
        async for _ in robot.watch():
            self._tell(Change.ROBOT)
            self._look_for_faults()

    def _look_for_faults(self) -> None:
        if self.faults != self._faults:
            self._faults = self.faults
            self._tell(Change.STATION)

    def _hear_eyes(self, event: object) -> None:
        """Of the station's own table: nobody plays, so that only what is seen has changed."""
        del event
        self._tell(Change.EYES)
        self._look_for_faults()


def _heard(task: "asyncio.Future[Any]") -> None:
    """Whoever asked for it may have gone, and its error with it."""
    if not task.cancelled():
        task.exception()

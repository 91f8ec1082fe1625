"""The station: one table with its robot and, one after another, its games. No HTTP, no views.

Any front end drives it: it calls the commands below, shows what the attributes say, and is told by
`Station.listen` that something has changed, and by `Station.events` what happens in the game. Each command
raises a `KempelenError` with a reason when the present state forbids it, and then has changed nothing.
Commands never queue: while one takes its time (`Station.busy`), others that need the same table are refused.
`Station.stop` is refused never, and waits for nothing.
"""

from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Any, Self

import chess

from kempelen.app.cast import EngineWish, GameRequest
from kempelen.app.config import Config
from kempelen.app.eyes import GameEyes
from kempelen.app.live_game import LiveGame
from kempelen.app.report import GameReport
from kempelen.app.station_types import (
    CalibrationState,
    Change,
    GameOptions,
    Phase,
    Prompt,
    StationFault,
)
from kempelen.app.table_session import TableSession
from kempelen.core.protocols import RobotState
from kempelen.game.clock import ClockReading
from kempelen.game.observers import EventBus

Listener = Callable[[Change], None]


class Station:
    """Async context manager; entering does nothing but make it usable: `connect` or `begin` come next.

    Args:
        config: Everything configured; `connect`, `begin` and `set_speed` override parts of it.

    Attributes:
        events: What happens in the running game (`kempelen.core.events`), of one game after the other.
        phase: What the station is doing.
        busy: What takes a while at the moment, in plain words; empty for nothing.
        live: The game on the table: running, over, or cut off by an e-stop or an error (``phase`` tells); it
            stays to be looked at until another one begins or it is left.
        report: Of ``live``, once it is over.
    """

    def __init__(self, config: Config) -> None:
        self._config = config
        self.events = EventBus()
        self.phase = Phase.OFF
        self.busy = ""
        self.live: LiveGame | None = None
        self.report: GameReport | None = None

    async def __aenter__(self) -> Self:
        """Usable from now on."""
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """As `aclose`."""

    async def aclose(self) -> None:
        """Robot at rest, game kept in the journal, port free, no process left."""
        raise NotImplementedError

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Call ``listener`` at once, in the loop, for whatever changes; it must be quick. Returns how to end."""
        raise NotImplementedError

    # --- what is ---

    @property
    def config(self) -> Config:
        """In force: that of the game, if there is one."""
        raise NotImplementedError

    @property
    def session(self) -> TableSession | None:
        """The table that is up, the game's or the station's own; None in phase ``off``."""
        raise NotImplementedError

    @property
    def robot(self) -> RobotState:
        """The robot's latest state."""
        raise NotImplementedError

    @property
    def speed(self) -> float:
        """The twin's time scale; 0 for as fast as it can."""
        raise NotImplementedError

    @property
    def faults(self) -> tuple[StationFault, ...]:
        """What is wrong, the gravest first."""
        raise NotImplementedError

    @property
    def prompts(self) -> tuple[Prompt, ...]:
        """What a person is asked or told, the oldest first."""
        raise NotImplementedError

    @property
    def clock(self) -> ClockReading | None:
        """Of the game; None when it has none."""
        raise NotImplementedError

    @property
    def eyes(self) -> GameEyes | None:
        """What looks at the board; None for nothing. ``eyes.eye`` is open while there is a session."""
        raise NotImplementedError

    @property
    def recording(self) -> str:
        """Name of the file that is being recorded to; empty for none."""
        raise NotImplementedError

    @property
    def calibration(self) -> CalibrationState:
        """The one in the making."""
        raise NotImplementedError

    @property
    def unfinished(self) -> int | None:
        """Number of the newest game of the journal that can be gone on with; None when there is none."""
        raise NotImplementedError

    async def truth(self) -> Mapping[str, Any] | None:
        """Twin: pieces, tool point, gripper and hand as they are; None without a twin, or when it is gone.

        Has a connection of its own, so that it never waits for the virtual person. Units are mm; ``pieces``
        have ``id``, ``kind`` (upper case), ``white``, ``x``, ``y``, ``z``, ``q`` (w, x, y, z), ``tilt``;
        ``tool`` is a point; ``closed``; ``hand`` is a point, or None when it is away.
        """
        raise NotImplementedError

    # --- table and robot ---

    async def connect(self, kind: str, port: str) -> None:
        """Connect a robot, or the same one again; a game that is shown is put away."""
        raise NotImplementedError

    async def disconnect(self) -> None:
        """Let go of it."""
        raise NotImplementedError

    async def home(self) -> None:
        """Find the reference switches; not while a game runs, which does it itself."""
        raise NotImplementedError

    async def recover(self) -> None:
        """Clear an alarm or a stop."""
        raise NotImplementedError

    async def stop(self) -> None:
        """E-stop: on the wire at once, whatever else is going on; a running game ends and can be resumed."""
        raise NotImplementedError

    async def jog(self, owner: str, direction: tuple[float, float, float], speed: float) -> None:
        """Keep moving at ``speed`` mm/s, for ``owner`` alone; motion ends when the calls do."""
        raise NotImplementedError

    async def jog_stop(self, owner: str) -> None:
        """End the jogging of ``owner``; of anybody else nothing is ended. Returns at rest."""
        raise NotImplementedError

    async def owner_left(self, owner: str) -> None:
        """A client has gone: whatever it was jogging stops."""
        raise NotImplementedError

    async def set_speed(self, speed: float) -> None:
        """Twin: time scale; 0 for as fast as it can."""
        raise NotImplementedError

    async def hand_carry(self, source: tuple[float, float], target: tuple[float, float]) -> None:
        """Twin: the virtual hand carries the piece nearest to ``source``, legal or not; x, y, mm."""
        raise NotImplementedError

    # --- games ---

    async def begin(self, request: GameRequest, options: GameOptions | None = None) -> int:
        """Begin a game; returns its number as soon as it is being played."""
        raise NotImplementedError

    async def resume_game(self, game: int | None = None, wish: EngineWish | None = None) -> int:
        """Go on with a game of the journal; None: the newest unfinished one. Returns its number."""
        raise NotImplementedError

    async def leave_game(self) -> None:
        """Robot at rest, game kept; the station has its own table again."""
        raise NotImplementedError

    async def pause(self) -> None:
        """Stop at once, also with a piece in the gripper; returns at rest."""
        raise NotImplementedError

    async def resume(self) -> None:
        """Go on."""
        raise NotImplementedError

    async def finish(self) -> None:
        """While paused: complete the move in hand."""
        raise NotImplementedError

    async def takeback(self, plies: int | None = None) -> None:
        """Undo half-moves on the table; None: to where a person was last to move."""
        raise NotImplementedError

    async def resign(self) -> None:
        """The person's side gives up; in a game of two persons the side to move."""
        raise NotImplementedError

    async def offer_draw(self) -> bool:
        """The person's side offers a draw; whether it was agreed."""
        raise NotImplementedError

    async def swap_mode(self, request: GameRequest) -> None:
        """Other players take over."""
        raise NotImplementedError

    async def move(self, text: str, ply: int | None = None) -> chess.Move:
        """A move of the person, in any notation; ``ply``: half-moves played when it was chosen."""
        raise NotImplementedError

    async def answer(self, prompt: str, text: str) -> None:
        """Answer a prompt: anything (``do``), yes or no (``yes_no``, ``draw``), a move (``which_move``)."""
        raise NotImplementedError

    # --- eyes ---

    async def bumped(self) -> str:
        """Measure the board again by camera, in mid-game; what came of it, in a sentence."""
        raise NotImplementedError

    async def set_eyes(self, *, on: bool) -> None:
        """Play by the camera or without; outside of a game: open or close the eyes."""
        raise NotImplementedError

    async def set_eye_parameter(self, name: str, value: float | None) -> None:
        """Override a parameter of the reader; None gives it back."""
        raise NotImplementedError

    async def record(self, *, on: bool) -> str:
        """Begin or end recording what the camera sees; the file's name."""
        raise NotImplementedError

    # --- calibration ---

    async def calibration_begin(self) -> None:
        """Measure the board anew; a running game is paused and its move finished first."""
        raise NotImplementedError

    async def calibration_touch(self, corner: str) -> None:
        """The closed fingertips are at this outer corner now."""
        raise NotImplementedError

    async def calibration_by_camera(self) -> None:
        """Find the board by the camera whose place over the robot is known."""
        raise NotImplementedError

    async def calibration_apply(self, square: float | None = None) -> None:
        """Keep it, and use it from now on; the hand rises and parks."""
        raise NotImplementedError

    async def calibration_cancel(self) -> None:
        """Keep the one before; the hand rises and parks."""
        raise NotImplementedError

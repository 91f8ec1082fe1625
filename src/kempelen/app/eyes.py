"""The eyes of one game: camera, eye, move reader and verifier wired together, and watched."""

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from contextlib import AsyncExitStack
from dataclasses import dataclass, field
from typing import Self

import chess
import numpy as np

from kempelen.app.board_reader import CAMERA_PARAMETERS, CameraReader
from kempelen.app.camera_pose import BoardPose, measure_board
from kempelen.app.camera_side import KnownSides, side_of
from kempelen.app.cameras import TWIN, open_camera, parse_camera
from kempelen.app.config import NODE_PORT, Config
from kempelen.app.eye import Eye, EyeSettings, Frames
from kempelen.app.eye_link import starter
from kempelen.app.hand_watch import HandWatch
from kempelen.app.judge import BoardJudge
from kempelen.app.layouts import board_of, layout_after
from kempelen.app.persistent import persistent
from kempelen.app.reed import open_reed, until_right
from kempelen.app.table_session import TableSession
from kempelen.core import events
from kempelen.core.errors import ConfigError, SensorError, TwinError
from kempelen.core.geometry import Array
from kempelen.core.places import Layout, Transfer
from kempelen.core.senses import BoardSensor, Observation, Sight
from kempelen.core.words import say
from kempelen.frames.condition import CameraState, CameraStatus
from kempelen.game.verify import SensorVerifier
from kempelen.sensing.fused import FusedSensor
from kempelen.sensing.reed.faults import SwitchFault
from kempelen.sensing.reed.parameters import REED_PARAMETERS
from kempelen.sensing.reed.sensor import ReedSensor
from kempelen.twin.client import Door

_PATIENCE_S = 1.0
"""A trouble that passes by itself so soon is not told."""
_STARTING_S = 6.0
"""Learning how a board looks takes less; what hinders it for so long is told."""
_PLACE_S = 2.0
"""The board's place is compared with where it was this often."""
_BUMP, _BUMP_LOOKS = 0.1, 2
"""Squares by which it must have moved, in so many looks: less does not keep the robot from gripping."""
_BUMPED = (
    "Board or camera have moved by about {mm:.0f} mm, so the robot waits. If it was the board, type: bumped. "
    "If it was the camera, put it back, or leave the game and calibrate it: kempelen calibrate --camera"
)
_FIRST_LOOKS = 12
"""Clear observations in which it is learned how the board looks; a person takes longer to sit down."""
_REVIVE_S = 3.0
"""After so long without a camera, the twin is asked for another one."""


@dataclass(frozen=True, slots=True)
class TwinFrames:
    """The ring of the twin's camera, or of none here: that of a camera at a node is the node's own affair.

    Attributes:
        ring: Its name; empty for none here.
        status: Whatever may be wrong, the eye finds out at the ring.
    """

    ring: str
    status: CameraStatus = field(default_factory=lambda: CameraStatus(CameraState.RUNNING))


class GameEyes:
    """Async context manager, entered when the table is up.

    What there is of camera and reed board looks as one sensor.

    Args:
        config: Which camera, and how to read.
        tell: Takes events.

    Attributes:
        reed: The reed board; None without.
        reader: For the person who plays.
        verifier: For the arbiter.
        busy: Tells whether the robot is at work: it is then over the board itself.
        near: Tells whether its hand is where it let go last; that of an arm may then hide the board.
        position: Tells the game so far.
        bumped: Called when board or camera are seen to have moved.
        latest: What was seen last.
        trouble: Why the board is not being watched at the moment; empty while it is.
    """

    def __init__(self, config: Config, tell: Callable[[events.Event], None]) -> None:
        self._config = config
        self._tell = tell
        self._stack = AsyncExitStack()
        self._eye: Eye | None = None
        self.reed: ReedSensor | None = None
        self._sensor: BoardSensor | None = None
        self._seen: Frames | None = None
        self._pieces = config.pieces.piece_set()
        self._control: Door | None = None
        self._square = config.table.square
        self._sides = KnownSides(config.data_dir / "white-sides.json")
        self._told, self._stuck_at = Sight.STARTING, ""
        self._hands = HandWatch()
        self._coming = Layout({})
        self._restarts = 0
        self._place: Array | None = None
        self._displaced = 0
        self._checked = 0.0
        self.reader = CameraReader(
            lambda: self.sensor, self._advise, REED_PARAMETERS if config.felt_only else CAMERA_PARAMETERS
        )
        self.trouble = ""
        self.busy: Callable[[], bool] = lambda: False
        self.near: Callable[[], bool] = lambda: False
        self.position: Callable[[], chess.Board] = chess.Board
        self.latest: Observation | None = None
        self.bumped: Callable[[], Awaitable[None]] = _nothing

    @property
    def sensor(self) -> BoardSensor:
        """What looks, all together.

        Raises:
            ConfigError: not entered.
        """
        if self._sensor is None:
            raise ConfigError("The eyes are not open yet.", hint="Set up the table first.")
        return self._sensor

    @property
    def eye(self) -> Eye:
        """The camera's.

        Raises:
            ConfigError: not entered, or there is no camera.
        """
        if self._eye is None and self._sensor is not None:
            raise ConfigError(
                "No camera looks at this board: the reed board feels it.",
                hint="Add one: --sensor camera,reed",
            )
        if self._eye is None:
            raise ConfigError("The eyes are not open yet.", hint="Set up the table first.")
        return self._eye

    @property
    def camera(self) -> Eye | None:
        """The camera's eye, if there is one and it is open."""
        return self._eye

    @property
    def ring(self) -> str:
        """Where the camera's frames are, for others who look; empty while it is closed."""
        return self._seen.ring if self._seen is not None else ""

    @property
    def on(self) -> bool:
        """Whether they are played by."""
        return self._sensor is not None and self.verifier.looks

    async def open(self, session: TableSession) -> Self:
        """Start looking at a table.

        Raises:
            ConfigError: there is no such camera.
            CameraError: it cannot be opened.
        """
        self._square = session.table.square
        try:
            if not self._config.felt_only:
                await self._open_eye(session)
            if self._config.sensor.reed:
                reed = await open_reed(self._config, session, self._tell_of_switch)
                self.reed = await self._stack.enter_async_context(reed)
        except BaseException:
            await self._stack.aclose()
            raise
        self._sensor = self._together()
        self.verifier = SensorVerifier(self._sensor, self._judge)
        self._watching = asyncio.create_task(persistent(self._watch, self._stumbled))
        return self

    async def _open_eye(self, session: TableSession) -> None:
        sensor = self._config.sensor
        settings = EyeSettings(sensor.use, sensor.parameters, session.table.square)
        frames = self._seen = await self._frames(session)
        eye = Eye(frames, settings, starter(self._config))
        eye.usual_side = self._sides.get(self._config.camera_source)
        self._eye = await self._stack.enter_async_context(eye)

    def _together(self) -> BoardSensor:
        there: dict[str, BoardSensor] = {}
        if self._eye is not None:
            there["camera"] = self._eye
        if self.reed is not None:
            there["reed board"] = self.reed
        if len(there) == 1:
            return next(iter(there.values()))
        return FusedSensor(there, lambda text: self._tell(events.SensorChanged(Sight.CLEAR, text)))

    async def _frames(self, session: TableSession) -> Frames:
        source = self._config.camera_source
        if not source:
            raise ConfigError(
                "No camera is named.", hint="Name one: --camera uvc:0, or play without: --sensor none."
            )
        if source.startswith(NODE_PORT):
            return TwinFrames("")
        camera = parse_camera(source)
        if camera.kind != TWIN:
            return await self._stack.enter_async_context(open_camera(camera, self._config, patient=True))
        frames = TwinFrames(session.ring)
        self._control = session.control
        return frames

    def _judge(self, transfers: Sequence[Transfer], standing: Layout) -> BoardJudge:
        return BoardJudge(transfers, standing, self._pieces, self._config.sensor.centred, self.reader.look)

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *exc: object) -> None:
        """Stop looking."""
        if self._sensor is not None:
            self._watching.cancel()
            await asyncio.gather(self._watching, return_exceptions=True)
        await self._stack.aclose()

    # --- what the game does with them ---

    def listen(self, event: events.Event) -> None:
        """Take what the arbiter tells: the eye has to know what should stand on the board."""
        match event:
            case (
                events.GameStarted()
                | events.MoveCommitted()
                | events.MoveTakenBack()
                | events.PositionSetUp()
            ):
                self._coming = event.layout
                self.expect(event.layout)
                self._confirmed(event.layout, seen=not isinstance(event, events.GameStarted))
                self._stands(event.layout)
            case events.MoveProposed() | events.SettingUp():
                self._coming = layout_after(self._coming, event.transfers)
                if not self.reader.looks:  # a game that goes on with a move in hand: nothing was seen before
                    self.expect(self._coming)
            case events.TransferStarted():
                self.reader.moves()

    def _stands(self, layout: Layout) -> None:
        """How it looks can be learned, unless the position of the game has yet to be set up."""
        position = self.position()
        if layout.board_part() == position.piece_map():
            self.reader.stands(position)
        else:
            self.reader.moves()

    def expect(self, layout: Layout) -> None:
        """Say what stands on the board, or will when the robot has gone from it."""
        if self._eye is not None:
            self._eye.expect(board_of(layout))

    def _confirmed(self, layout: Layout, *, seen: bool) -> None:
        """What stands there, or should at the start; what is known is what each sensor is held against."""
        board = self.position().copy()
        board.set_piece_map(layout.board_part())  # while a position is set up, the game's is yet to come
        if self.reed is not None and seen:
            self.reed.stands(board)
        elif self.reed is not None:
            self.reed.expect(board)
        if isinstance(self._sensor, FusedSensor) and seen:
            self._sensor.stands(board)

    async def pose(self) -> BoardPose:
        """Where the board is now, from several looks.

        Raises:
            SensorError: it is not seen, or not in space.
            CalibrationError: the looks disagree.
        """
        pose = await measure_board(self.eye, self._square)
        self._place, self._displaced = None, 0
        return pose

    async def awake(self) -> None:
        """Returns when the board is in clear view, and has been for a second or so since the game began.

        Whoever moves a piece before that is not seen doing it.
        """
        async for seen in self.sensor.observe():
            enough = seen.valid and self.reader.looks >= _FIRST_LOOKS
            if enough or not self.verifier.looks:
                return

    async def begin_right(self, layout: Layout, given_up: Callable[[], bool]) -> None:
        """Before a game's first move, with a reed board: returns when the pieces stand as they should."""
        if self.reed is not None:
            self._confirmed(layout, seen=False)
            await until_right(self.verifier, layout, self._advise, given_up)

    def switch(self, *, on: bool) -> None:
        """Go on without eyes, or with them again."""
        self.verifier.looks = on
        self.reader.switch(on=on)

    # --- what is told of them ---

    def _advise(self, event: events.Event) -> None:
        """A question or advice; the reed board lights the squares that it is about, and sounds a warning."""
        if self.reed is not None and isinstance(event, events.BoardDiffers):
            self.reed.warn(event.advice)
        elif self.reed is not None and isinstance(event, events.SensorUnsure):
            self.reed.show(event.question)
        self._tell(event)

    def _tell_of_switch(self, fault: SwitchFault) -> None:
        self._tell(events.SensorChanged(Sight.CLEAR, fault.sentence))

    async def _watch(self) -> None:
        """Tell when the board is lost and seen again, and of hands over it."""
        since, revived = asyncio.get_running_loop().time(), 0.0
        last = Sight.STARTING
        async for seen in self.sensor.observe():
            now = asyncio.get_running_loop().time()
            self.latest = seen
            self.reader.glance(seen)
            if self._eye is not None and self._eye.restarts != self._restarts:
                self._restarts = self._eye.restarts
                self.expect(self._coming)  # a new eye begins from what will stand when the robot has gone
            if seen.sight is not last:
                last, since = seen.sight, now
            if (hand := self._hands.look(seen, robot=self.busy() or self.near())) is not None:
                self._tell(events.HandOverBoard(hand))
            if now - since >= _PATIENCE_S or seen.valid:
                self._tell_of_sight(seen, now - since)
            if seen.valid and now - self._checked > _PLACE_S and not self.busy():
                self._checked = now
                await self._check_place()
            if seen.sight is Sight.NO_CAMERA and now - max(since, revived) > _REVIVE_S:
                revived = now
                await self._revive()
            self._goes_well(seen)

    def _stumbled(self, error: Exception) -> None:
        """The game would wait for ever if nobody watched, and nobody knew why."""
        text = f"A fault of the program stopped the watching of the board; it was started again: {error!r}."
        self.trouble = say("eyes_fault", text)
        self._tell(events.SensorChanged(self._told, self.trouble))

    def _goes_well(self, seen: Observation) -> None:
        if self.trouble:
            self.trouble = ""
            self._tell(events.SensorChanged(seen.sight, seen.message))

    def _tell_of_sight(self, seen: Observation, waited: float) -> None:
        """A hand is no trouble, and what was told once is not told again; what keeps it from starting is."""
        stuck = seen.sight is Sight.STARTING and waited >= _STARTING_S and seen.message != self._stuck_at
        if seen.hand or (seen.sight is self._told and not stuck):
            return
        self._told, self._stuck_at = seen.sight, seen.message if stuck else ""
        self._tell(events.SensorChanged(seen.sight, seen.message))

    async def _check_place(self) -> None:
        """The robot relies on the board's place: what moves it, or the camera, must not go unnoticed."""
        if self._eye is None:
            return
        try:
            corners = np.array((await self.eye.sighting()).corners)
        except SensorError:
            return
        if self._place is None:
            self._place = corners
            self.eye.usual_side = side_of(corners)
            self._sides.put(self._config.camera_source, self.eye.usual_side)
            return
        side = float(np.linalg.norm(corners[1] - corners[0])) / 8
        away = float(np.linalg.norm(corners - self._place, axis=1).max()) / side
        self._displaced = self._displaced + 1 if away > _BUMP else 0
        if self._displaced == _BUMP_LOOKS:
            mm = away * self._square
            self._tell(events.BoardDiffers(say("bumped", _BUMPED.format(mm=mm), mm=round(mm))))
            await self.bumped()

    async def _revive(self) -> None:
        """The twin's camera is a process, too, and can die; one that is only starting is left alone."""
        if self._control is not None:
            try:
                cameras = (await self._control.ask("stats"))["cameras"]
                if not all(camera["alive"] for camera in cameras):
                    await self._control.ask("restart_camera")
            except TwinError as error:
                self._tell(events.SensorChanged(Sight.NO_CAMERA, str(error)))


async def _nothing() -> None:
    """Nobody wants to know."""

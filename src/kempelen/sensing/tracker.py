"""The tracker: frames in, observations out.

It finds the board, learns from the known position at the start what this camera makes of it, follows it,
finds it again after a bump, and reads each frame by depth, by colour, or by both: their log-likelihoods add
up, for their errors have nothing in common.
"""

import time as clock
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import chess
import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Frame
from kempelen.core.errors import SensorError
from kempelen.core.geometry import Array
from kempelen.core.senses import BLACK, EMPTY, WHITE, Observation, Sight, states_of
from kempelen.sensing.board.finder import BoardFinder
from kempelen.sensing.colour.reader import ColourReader
from kempelen.sensing.colour_gate import ColourGate, colour_gate_parameters
from kempelen.sensing.depth.gate import DepthGate, gate_parameters
from kempelen.sensing.depth.geometry import Cameras, Mask, Pixels
from kempelen.sensing.depth.likelihood import depth_parameters
from kempelen.sensing.depth.reader import DepthLook, DepthReader, DepthReading
from kempelen.sensing.health import HealthCheck, health_parameters
from kempelen.sensing.locator import Finder, Located, Locator, locator_parameters
from kempelen.sensing.parameters import Parameter, Parameters
from kempelen.sensing.sighting import BoardSighting

_CONTRADICTED = 4.0  # nats by which depth must speak against what was told of a square
_REMEMBER = 5  # frames between two lessons about the empty board
_SURE = 4.0  # nats


class Use(StrEnum):
    """What is read."""

    BOTH = "both"
    DEPTH = "depth"
    COLOUR = "colour"

    @property
    def depth(self) -> bool:
        """Whether depth is read."""
        return self is not Use.COLOUR

    @property
    def colour(self) -> bool:
        """Whether colour is read."""
        return self is not Use.DEPTH


@dataclass(frozen=True, slots=True)
class TrackerSettings:
    """How to track.

    Attributes:
        use: What is read.
        learn_frames: Clear frames that are learned from before the first reading.
        overrides: Parameters set by hand, by name.
    """

    use: Use = Use.BOTH
    learn_frames: int = 5
    overrides: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class TrackerView:
    """What the tracker made of its last frame, for people to look at.

    Attributes:
        frame: That was read.
        observation: That came of it.
        sighting: Of the board; None when it is not found.
        heights: (size, size) mm over the board's plane, margin included, row 0 at rank 1; None without depth.
        hand: (size, size) cells taken for a hand; None when nobody looked.
        parameters: Names, values, units, where from.
        stages: ms that each stage took.
    """

    frame: Frame
    observation: Observation
    sighting: BoardSighting | None
    heights: Pixels | None
    hand: Mask | None
    parameters: list[dict[str, Any]]
    stages: Mapping[str, float]


class Tracker:
    """Reads a board from frames alone. No clock but that of the frames, no I/O; for one thread.

    Args:
        settings: How to track.
        finder: That finds the board; a `BoardFinder` without settings by default.
        colour: That reads colour.

    Raises:
        ConfigError: an override of no parameter, or outside its range.
    """

    def __init__(
        self,
        settings: TrackerSettings | None = None,
        *,
        finder: Finder | None = None,
        colour: ColourReader | None = None,
    ) -> None:
        self.settings = settings or TrackerSettings()
        use = self.settings.use
        self.parameters = _all_parameters()
        self.parameters.override_all(self.settings.overrides)
        self._health = HealthCheck(colour=use.colour, depth=use.depth, parameters=self.parameters)
        self._locator = Locator(finder or BoardFinder(), self.parameters)
        self._depth = DepthReader(self.parameters)
        self._depth_gate = DepthGate(self.parameters)
        self._colour = colour or ColourReader()
        self._colour_gate = ColourGate(self.parameters)
        self._board: chess.BaseBoard | None = None
        self._position: npt.NDArray[np.int64] | None = None
        self._told = False  # whether a position waits to be learned by the colour reader
        self._learned = 0
        self._frames = 0
        self._hand = False  # whether one was seen in the frame before
        self._colour_read: tuple[float, Array] | None = None  # when, and what it said
        self._cameras: Cameras | None = None
        self._stages: dict[str, float] = {}
        self._view: TrackerView | None = None

    def expect(self, position: chess.BaseBoard | npt.ArrayLike | None) -> None:
        """Say what stands on the board: at the start of a game, and after each move that was accepted.

        Args:
            position: A board, (64,) of {EMPTY, WHITE, BLACK}, or None when nobody knows.
        """
        board = position if isinstance(position, chess.BaseBoard) or position is None else _men(position)
        self._board = board
        self._position = None if board is None else states_of(board)
        self._told = board is not None

    def look_again(self) -> None:
        """Forget where the board is, and find it anew."""
        self._locator.forget()

    def update(self, frame: Frame) -> Observation:
        """Read a frame."""
        self._stages = {}
        self._frames += 1
        observation, located, look, mask = self._read(frame)
        self._view = TrackerView(
            frame,
            observation,
            located.sighting if located else None,
            None if look is None else look.map.heights,
            mask,
            self.parameters.to_json(),
            dict(self._stages),
        )
        return observation

    @staticmethod
    def stale(time: float, seconds: float) -> Observation:
        """What to report when no frame has come for so long, s."""
        return Observation.blind(
            time,
            Sight.STALE,
            f"No picture from the camera for {seconds:.1f} s. Check its cable; it is being asked again.",
        )

    def view(self) -> TrackerView | None:
        """What was made of the last frame; None before the first."""
        return self._view

    def _read(self, frame: Frame) -> tuple[Observation, Located | None, DepthLook | None, Mask | None]:
        with self._stage("health"):
            health = self._health.check(frame)
        if not health.good:
            return Observation.blind(frame.time, health.sight, health.message), None, None, None
        with self._stage("board"):
            located = self._locator.locate(frame, self._board, blocked=self._hand)
        if located.sighting is None:
            return Observation.blind(frame.time, located.sight, located.message), located, None, None
        try:
            return self._read_board(frame, located, located.sighting)
        except SensorError as error:
            self._locator.forget()
            return Observation.blind(frame.time, Sight.NO_BOARD, str(error)), located, None, None

    def _read_board(
        self, frame: Frame, located: Located, sighting: BoardSighting
    ) -> tuple[Observation, Located, DepthLook | None, Mask | None]:
        look = None
        if self.settings.use.depth:
            self._place(frame, sighting, new=located.new)
            with self._stage("depth"):
                look = self._depth.look(frame)
        elif located.new:
            self._colour_gate.forget()
        with self._stage("hand"):
            hand, reason, mask = self._gate(frame, sighting, look)
        if hand or self._hand:
            if not hand:  # it may have taken the board with it
                self._locator.check_soon()
                reason = "the hand has just gone"
            self._hand, self._colour_read = hand, None
            return Observation.blind(frame.time, Sight.HAND, f"Waiting: {reason}."), located, look, mask
        if self._learned < self.settings.learn_frames:
            with self._stage("learn"):
                self._learn(look)
            message = "Learning what the board looks like: keep away from it for a moment."
            return Observation.blind(frame.time, Sight.STARTING, message), located, look, mask
        return self._observe(frame, located, sighting, look), located, look, mask

    def _place(self, frame: Frame, sighting: BoardSighting, *, new: bool) -> None:
        """Relate depth to the board anew, where board or cameras have changed."""
        cameras = Cameras.of(frame)
        if new:
            self._colour_read = None
        if not new and self._cameras is not None and self._cameras.same_as(cameras):
            return
        with self._stage("place"):
            self._depth.place(frame, sighting)
        self._cameras = cameras
        self._depth_gate.forget()
        self._learned = 0

    def _gate(self, frame: Frame, sighting: BoardSighting, look: DepthLook | None) -> tuple[bool, str, Mask]:
        if look is not None:
            seen = self._depth_gate.check(look.map, look.contrast, look.noise, frame.time)
            if not seen.hand:
                self._depth_gate.accept(look.map, look.contrast, look.noise, frame.time)
            return seen.hand, seen.reason, seen.mask
        if frame.colour is None:  # the health check has said so
            raise SensorError("The frame has no colour picture.", hint="Choose depth.")
        found = self._colour_gate.check(frame.colour, sighting, frame.time)
        if not found.hand:
            self._colour_gate.accept()
        return found.hand, found.reason, found.mask

    def _learn(self, look: DepthLook | None) -> None:
        self._learned += 1
        if look is None:
            return
        self._depth.learn_from(look, self._undisputed(look))
        if self._learned == self.settings.learn_frames:
            self._depth_gate.expect_tallest(float(np.nanmax(look.evidence.peaks.tops, initial=0.0)))

    def _undisputed(self, look: DepthLook) -> npt.NDArray[np.int64] | None:
        """The position that was told, unless depth contradicts it: then nobody knows."""
        if self._position is None or self._contradicted(self._depth.judge(look)).any():
            return None
        return self._position

    def _contradicted(self, reading: DepthReading) -> Mask:
        """(64,) squares where depth speaks against the position that was told."""
        if self._position is None:
            return np.zeros(64, dtype=bool)
        over = reading.log_likelihood[:, WHITE] - reading.log_likelihood[:, EMPTY]
        out: Mask = np.where(self._position == EMPTY, over, -over) > _CONTRADICTED
        return out

    def _observe(
        self, frame: Frame, located: Located, sighting: BoardSighting, look: DepthLook | None
    ) -> Observation:
        log_likelihood = np.zeros((64, 3))
        reading = None
        if look is not None:
            with self._stage("squares"):
                reading = self._depth.judge(look)
                self._adapt(look, reading)
            log_likelihood += reading.log_likelihood * self.parameters["fuse.depth"]
        if self.settings.use.colour:
            with self._stage("colour"):
                seen = self._by_colour(frame, sighting, reading, looked=located.looked)
                log_likelihood += seen * self.parameters["fuse.colour"]
        if look is None and not self._colour.ready:
            message = (
                "Set up the position that the game starts from, and say so: colour alone has to see it first."
            )
            return Observation.blind(frame.time, Sight.STARTING, message)
        return Observation(
            log_likelihood - log_likelihood.max(axis=1, keepdims=True),
            frame.time,
            heights=None if reading is None else reading.heights,
            offsets=None if reading is None else reading.offsets,
        )

    def _adapt(self, look: DepthLook, reading: DepthReading) -> None:
        """Squares that are surely empty are taken into the reference; the rest follows by itself."""
        if self._frames % _REMEMBER:
            return
        sure = reading.log_likelihood[:, WHITE] < -_SURE
        self._depth.adapt(look, sure)

    def _by_colour(
        self, frame: Frame, sighting: BoardSighting, reading: DepthReading | None, *, looked: bool
    ) -> Array:
        """(64, 3) log-likelihoods; zeros until a known position was seen.

        Beside depth it rests for a few frames to save time, and for longer in frames whose time already went
        into looking for the board.
        """
        disputed = reading is not None and self._contradicted(reading).any()
        if self._told and self._position is not None and not disputed:
            self._colour.learn(frame, sighting, self._position)
            self._told = False
            self._colour_read = None
        if not self._colour.ready:
            return np.zeros((64, 3))
        rest = self.parameters["colour.period"] * (2 if looked else 1)
        read = self._colour_read
        if reading is None or read is None or not 0 <= frame.time - read[0] < rest:
            read = self._colour_read = frame.time, self._colour.read(frame, sighting)
        return read[1]

    @contextmanager
    def _stage(self, name: str) -> Iterator[None]:
        start = clock.perf_counter()
        try:
            yield
        finally:
            self._stages[name] = self._stages.get(name, 0.0) + 1000 * (clock.perf_counter() - start)


def _men(position: npt.ArrayLike) -> chess.BaseBoard:
    """A board with pawns where an occupancy has pieces."""
    states = np.asarray(position, dtype=np.int64)
    if states.shape != (64,) or not np.isin(states, (EMPTY, WHITE, BLACK)).all():
        raise ValueError(f"an occupancy is 64 numbers 0, 1 or 2, not {states.shape}")
    board = chess.BaseBoard(None)
    for square in np.flatnonzero(states != EMPTY):
        board.set_piece_at(int(square), chess.Piece(chess.PAWN, bool(states[square] == WHITE)))
    return board


def _all_parameters() -> Parameters:
    own = Parameters(
        Parameter("fuse.depth", 1.0, "", 0, 1, "weight of what depth says"),
        Parameter("colour.period", 0.09, "s", 0, 2, "beside depth, colour is read this often"),
        Parameter("fuse.colour", 1.0, "", 0, 1, "weight of what colour says"),
    )
    groups = (
        depth_parameters(), gate_parameters(), colour_gate_parameters(), health_parameters(),
        locator_parameters(), own,
    )  # fmt: skip
    return Parameters(*(parameter for group in groups for parameter in group))

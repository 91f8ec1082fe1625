"""The eye as the program sees it: a process of its own that turns frames into observations.

It is started, told what to expect, watched, and started again when it dies; meanwhile, and whenever it falls
silent, there are observations that say so. Whoever waits for the board to be seen is never left waiting
without a word.
"""

import asyncio
import itertools
import logging
import time
from collections import deque
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import TracebackType
from typing import Any, Protocol, Self

import chess
import numpy as np

from kempelen.app.eye_link import EyeLink, EyeProcess
from kempelen.app.eye_wire import Note, observation_of
from kempelen.core.errors import KempelenError, SensorError
from kempelen.core.geometry import Transform
from kempelen.core.senses import Observation, Sight
from kempelen.frames.condition import CameraStatus

SILENT_S = 3.0
"""Without a word from its process for so long, the eye counts as blind."""
HANG_S = 30.0
"""And for so long, as hung: it is ended, and started again."""
ANSWER_S = 20.0
_CHECK_S = 0.2
_RECENT = 32
_FIRST_WAIT_S, _LONGEST_WAIT_S = 0.2, 5.0
_SETTLED_S = 10.0

_log = logging.getLogger(__name__)


class Frames(Protocol):
    """Where frames come from: an open camera (`kempelen.app.cameras.OpenCamera`), or the twin."""

    @property
    def ring(self) -> str:
        """Name of the ring that they are written to; empty for none at the moment."""
        ...

    @property
    def status(self) -> CameraStatus:
        """How the camera is."""
        ...


@dataclass(frozen=True, slots=True)
class EyeSettings:
    """How the eye reads.

    Attributes:
        use: ``both``, ``depth`` or ``colour``.
        overrides: Parameters set by hand, by name.
        square: Side of the board's squares, mm; None when nobody knows.
        side: Of the picture at which White sits: ``bottom``, ``top``, ``left``, ``right``; empty when the
            position has to tell.
    """

    use: str = "both"
    overrides: Mapping[str, float] = field(default_factory=dict)
    square: float | None = None
    side: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class SeenBoard:
    """Where the board is in the camera's view.

    Attributes:
        camera_from_board: Pose, mm; None where intrinsics or the square's side are unknown.
        residual: RMS of the lattice's points, squares.
        confidence: 0 to 1.
        oriented: Whether it is known which corner is a1.
        square: Side of a square, mm, as measured.
        corners: (4, 2) pixels of the outer corners of a1, h1, h8, a8.
        method: That found it.
    """

    camera_from_board: Transform | None
    residual: float
    confidence: float
    oriented: bool
    square: float | None
    corners: list[list[float]]
    method: str


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """An observation, its number, and the mark that its frame is not older than."""

    number: int
    mark: int
    observation: Observation


class Eye:
    """A `kempelen.core.senses.BoardSensor`. Async context manager.

    Args:
        frames: Where they come from; may change its ring at any time.
        settings: How to read.
        start: Makes a way to its process, which may be at another machine.

    Attributes:
        restarts: How often its process had to be started again.
        usual_side: Of the picture, at which White was seen to sit; for the next process.
    """

    def __init__(
        self,
        frames: Frames,
        settings: EyeSettings | None = None,
        start: Callable[[], EyeLink] = EyeProcess,
    ) -> None:
        self._frames = frames
        self._settings = settings or EyeSettings()
        self._overrides = dict(self._settings.overrides)
        self._start = start
        self._link: EyeLink | None = None
        self._news = asyncio.Event()
        self._numbers = itertools.count(1)
        self._answers: dict[int, asyncio.Future[Note]] = {}
        self._marks = 0
        self._expected = ""
        self._told: tuple[str, str] | None = None
        self._heard = time.monotonic()
        self._latest: Observation = Observation.blind(0.0, Sight.STARTING, "The eye is opening.")
        self._recent: deque[_Seen] = deque(maxlen=_RECENT)
        self._count = 0
        self.restarts = 0
        self.usual_side = ""

    async def __aenter__(self) -> Self:
        """Start the process; what it sees comes later."""
        self._tasks = [asyncio.create_task(self._keep()), asyncio.create_task(self._mind())]
        return self

    async def __aexit__(
        self, _kind: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        """End it."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    # --- what it sees ---

    @property
    def latest(self) -> Observation:
        """The newest observation; says why when nothing is seen."""
        return self._latest

    @property
    def pid(self) -> int | None:
        """Of its process; None between two."""
        return self._link.pid if self._link else None

    def observe(self) -> AsyncIterator[Observation]:
        """Observations of frames taken from now on; a slow reader skips to the newest.

        Reports that nothing can be seen come at least every few seconds, so that nobody waits unknowingly.
        """
        self._marks += 1
        self._send("mark", mark=self._marks)
        return _Looks(self, self._marks)

    async def next_after(self, mark: int, number: int) -> tuple[int, Observation]:
        """The newest fresh observation after that of ``number``, and its own number.

        If nothing was to be seen in between, that is told first: it may have been a hand.
        """
        while True:
            fresh = [seen for seen in self._recent if seen.number > number and seen.mark >= mark]
            if fresh:
                hidden = [seen for seen in fresh if not seen.observation.valid]
                told = hidden[-1] if hidden else fresh[-1]
                return told.number, told.observation
            self._news.clear()
            await self._news.wait()

    def expect(self, position: chess.BaseBoard | None) -> None:
        """Say what stands on the board: at the start, and after each move that counts."""
        self._expected = position.board_fen() if position is not None else ""
        self._send("expect", fen=self._expected)

    def look_again(self) -> None:
        """Forget where the board is, and find it."""
        self._send("look again")

    async def picture(self) -> bytes:
        """The annotated view, a PNG file.

        Raises:
            SensorError: nothing has been seen yet, or the eye does not answer.
        """
        return (await self._ask("view")).data

    async def layers(self, ground: str, layers: Sequence[str], width: int) -> bytes:
        """A view as `kempelen.sensing.draw.layered` draws it, a JPEG file; raises as `picture`."""
        return (await self._ask("view", ground=ground, layers=list(layers), width=width)).data

    async def sighting(self) -> SeenBoard:
        """Where the board is in the camera's view.

        Raises:
            SensorError: it is not found, or the eye does not answer.
        """
        fields = dict((await self._ask("sighting")).fields)
        pose = fields.pop("camera_from_board")
        fields.pop("number")
        return SeenBoard(camera_from_board=None if pose is None else _transform(pose), **fields)

    async def parameters(self) -> list[dict[str, Any]]:
        """All numbers that it reads with: name, value, unit, where from.

        Raises:
            SensorError: the eye does not answer.
        """
        parameters: list[dict[str, Any]] = (await self._ask("parameters")).fields["parameters"]
        return parameters

    async def set(self, name: str, value: float | None) -> None:
        """Override a parameter; None gives it back to the reader.

        Raises:
            SensorError: no such parameter, a value out of its range, or the eye does not answer.
        """
        await self._ask("set", name=name, value=value)
        self._overrides.pop(name, None)
        if value is not None:
            self._overrides[name] = value

    # --- talking to the process ---

    def _send(self, op: str, **fields: object) -> None:
        """Said again to the next process, where it matters; nobody listens between two."""
        if self._link is not None:
            self._link.send(Note(op, fields))

    async def _ask(self, what: str, **fields: object) -> Note:
        number = next(self._numbers)
        future = self._answers[number] = asyncio.get_running_loop().create_future()
        self._send("ask", number=number, what=what, **fields)
        try:
            async with asyncio.timeout(ANSWER_S):
                note: Note = await future
        except TimeoutError:
            raise SensorError(
                f"The eye has not answered for {ANSWER_S:.0f} s. {self._latest.message}".rstrip(),
                hint="Wait for it, or leave the game and resume it.",
            ) from None
        finally:
            del self._answers[number]
        if "error" in note.fields:
            raise SensorError(note.fields["error"], hint=note.fields["hint"])
        return note

    def _see(self, observation: Observation, mark: int) -> None:
        self._latest = observation
        self._count += 1
        self._recent.append(_Seen(self._count, mark, observation))
        self._news.set()

    def _go_blind(self, sight: Sight, message: str) -> None:
        """A report of the program's own; there is nothing older under way that could be taken for newer."""
        self._see(Observation.blind(self._latest.time, sight, message), self._marks)

    # --- keeping it alive ---

    async def _keep(self) -> None:
        wait = _FIRST_WAIT_S
        while True:
            began = time.monotonic()
            how = await self._live()
            self.restarts += 1
            _log.debug("%s", how)
            self._go_blind(Sight.NO_CAMERA, how)
            wait = _FIRST_WAIT_S if time.monotonic() - began > _SETTLED_S else min(2 * wait, _LONGEST_WAIT_S)
            await asyncio.sleep(wait)

    async def _live(self) -> str:
        """One process from start to end; how it ended."""
        link = self._start()
        try:
            await link.open()
            await self._attend(link)
        except KempelenError as error:
            return str(error)
        finally:
            self._link = None
            how = await link.end()
        return how

    async def _attend(self, link: EyeLink) -> None:
        """Tell it all that it has to know, and listen."""
        self._link = link
        self._heard, self._told = time.monotonic(), None
        settings = self._settings
        self._send(
            "begin",
            use=settings.use,
            overrides=self._overrides,
            square=settings.square,
            side=settings.side,
            usual=self.usual_side,
        )
        self._send("expect", fen=self._expected)
        self._send("mark", mark=self._marks)
        self._tell_ring()
        while (note := await link.receive()) is not None:
            self._heard = time.monotonic()
            if note.op == "seen":
                self._see(observation_of(note), note.fields["mark"])
            elif (asked := self._answers.get(note.fields["number"])) is not None and not asked.done():
                asked.set_result(note)

    async def _mind(self) -> None:
        """Look after the ring's name and a process that says nothing."""
        while True:
            await asyncio.sleep(_CHECK_S)
            self._tell_ring()
            silent = time.monotonic() - self._heard
            if self._link is not None and silent > HANG_S:
                self._link.kill()
            elif silent > SILENT_S and self._latest.sight is not Sight.STARTING:
                self._go_blind(Sight.STALE, f"The eye has said nothing for {silent:.0f} s; it is waited for.")

    def _tell_ring(self) -> None:
        now = self._frames.ring, self._frames.status.message
        if now != self._told and self._link is not None:
            self._told = now
            self._send("ring", name=now[0], message=now[1])


def _transform(rows: list[list[float]]) -> Transform:
    matrix = np.array(rows)
    return Transform(matrix[:3, :3], matrix[:3, 3])


class _Looks:
    """An iterator over observations that are fresh.

    Args:
        eye: Whose.
        mark: That the frames must not be older than.
    """

    def __init__(self, eye: Eye, mark: int) -> None:
        self._eye = eye
        self._mark = mark
        self._number = -1

    def __aiter__(self) -> AsyncIterator[Observation]:
        return self

    async def __anext__(self) -> Observation:
        self._number, observation = await self._eye.next_after(self._mark, self._number)
        return observation

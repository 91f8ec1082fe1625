"""Reads a person's moves off the board, and tells what it is unsure of."""

import asyncio
from collections.abc import Callable, Sequence

import chess

from kempelen.app.judge import absent
from kempelen.core import events
from kempelen.core.geometry import Array
from kempelen.core.senses import BoardSensor, Observation
from kempelen.core.words import say
from kempelen.game.players import Propose, TakenBack
from kempelen.sensing.moves import verdicts
from kempelen.sensing.moves.parameters import MoveParameters
from kempelen.sensing.moves.reader import MoveReader

Tell = Callable[[events.Event], None]
CAMERA_PARAMETERS = MoveParameters(plies=1)
"""Between two moves that are read, the robot makes the other side's: one ply at a time."""


class CameraReader:
    """A `kempelen.game.board_person.BoardReader` over a board sensor.

    One reader goes through the whole game, so that it learns how each square looks.

    Args:
        sensor: Asked anew for each move.
        tell: Takes questions and advice.
        parameters: Of the reading.

    Attributes:
        looks: Clear observations so far.
        on: Whether anything is being read.
        candidates: Moves that may have been made, while a question is open.
        stuck: Set while only a person can help.
    """

    def __init__(
        self, sensor: Callable[[], BoardSensor], tell: Tell, parameters: MoveParameters = CAMERA_PARAMETERS
    ) -> None:
        self._sensor = sensor
        self._parameters = parameters
        self._tell = tell
        self._reader: MoveReader | None = None
        self._said = ""
        self._learning = self._reading = False
        self._glanced: Observation | None = None
        self.looks = 0
        self.on = True
        self.candidates: tuple[chess.Move, ...] = ()
        self.stuck = asyncio.Event()

    @property
    def look(self) -> Array | None:
        """(64, 3) how each square has looked; None before the first move was read."""
        return None if self._reader is None else self._reader.expected_look

    def stands(self, board: chess.Board) -> None:
        """A position has been verified, or set up: how it looks can be learned until something is moved."""
        self._confirm(board)
        self._learning = True

    def moves(self) -> None:
        """The robot is about to change the position."""
        self._learning = False

    def glance(self, seen: Observation) -> None:
        """An observation that no turn's reading takes in: what is looked at for longer is known better.

        A turn reads frames taken after it began; those before them are as good to learn from.
        """
        self.looks += seen.valid
        if self._reader is not None and self._learning and not self._reading:
            self._reader.update(seen)
            self._glanced = seen

    def switch(self, *, on: bool) -> None:
        """Go on without reading, or read again."""
        self.on = on
        if not on:
            self.stuck.set()

    async def read(self, board: chess.Board) -> Propose | TakenBack:
        """Wait until a move was made on the board, or moves were taken back."""
        self._begin(board)
        try:
            async for seen in self._sensor().observe():
                self._reading = True
                if self.on and self._reader is not None and seen is not self._glanced:
                    found = self._weigh(self._reader.update(seen), board)
                    if found is not None:
                        return found
        finally:
            self._reading = False
            self._settle()
        raise EOFError("The sensor has ended.")

    def _confirm(self, board: chess.Board) -> None:
        if self._reader is None:
            self._reader = MoveReader(board, self._parameters)
        else:
            self._reader.confirm(board)

    def _begin(self, board: chess.Board) -> None:
        self._confirm(board)
        self.stuck.clear()
        if not self.on:
            self.stuck.set()

    def _weigh(self, verdict: verdicts.Verdict, board: chess.Board) -> Propose | TakenBack | None:
        match verdict:
            case verdicts.Moved(moves=(move, *_)):
                return Propose(move, made=True)
            case verdicts.TakenBack(plies=plies, moves=()):
                return TakenBack(plies)
            case verdicts.TakenBack(plies=plies, moves=moves):
                self._advise(_other_move(board, plies, moves))
            case verdicts.Unsure():
                self._ask(verdict)
            case verdicts.Wrong(advice=advice, differences=differences):
                self._advise(advice, differences)
            case verdicts.Unchanged():
                self._settle()
            case _:
                pass
        return None

    def _ask(self, verdict: verdicts.Unsure) -> None:
        self.candidates = tuple(line[0] for line in verdict.candidates if len(line) == 1)
        self.stuck.set()
        if self._is_new(verdict.question):
            moves = tuple(move.uci() for move in self.candidates)
            self._tell(events.SensorUnsure(verdict.question, moves))

    def _advise(self, advice: str, differences: Sequence[verdicts.Difference] = ()) -> None:
        self.candidates = ()
        self.stuck.set()
        if self._is_new(advice):
            self._tell(events.BoardDiffers(advice, *absent(differences)))

    def _is_new(self, text: str) -> bool:
        new, self._said = text != self._said, text
        return new

    def _settle(self) -> None:
        """Nothing is open any more."""
        self.candidates = ()
        if self.on:
            self.stuck.clear()
        if self._said:
            self._said = ""
            self._tell(events.BoardDiffers(""))


def _other_move(board: chess.Board, plies: int, moves: verdicts.Line) -> str:
    before = board.copy()
    for _ in range(plies):
        before.pop()
    san = before.san(moves[0])
    text = (
        f"It looks as if {san} had been played instead of an earlier move. Put that back; "
        f"moves that are to be undone, type: takeback {plies}."
    )
    return say("other_move", text, move=san, plies=plies)

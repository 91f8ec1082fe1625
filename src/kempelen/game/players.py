"""Players: sources of moves for one side.

A player knows nothing of robots, journals or the opponent; it is handed the game so far and answers. So any
player can take over any side at any ply.
"""

import asyncio
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import chess
from pydantic import JsonValue

from kempelen.core.errors import NotationError
from kempelen.core.protocols import Engine, OnThinking, Thinking
from kempelen.core.words import say
from kempelen.game.notation import parse_move
from kempelen.game.pgn import GameScore
from kempelen.game.records import PlayerSpec

DRAW_MARGIN = 20  # centipawns: an engine that sees no more than this for itself takes a draw
DRAW_FROM_MOVE = 30  # no engine agrees to a draw before this move
MOVES_TO_GO = 30  # for so many more an engine saves time on the clock
LEAST_S = 0.02


@dataclass(frozen=True, slots=True)
class Propose:
    """The player wants to make this move.

    Attributes:
        made: It has been made on the board already, by the player's own hand.
    """

    move: chess.Move
    made: bool = False


@dataclass(frozen=True, slots=True)
class TakenBack:
    """The player has taken half-moves back on the board."""

    plies: int


@dataclass(frozen=True, slots=True)
class Resign:
    """The player gives up."""


@dataclass(frozen=True, slots=True)
class ScoreEnds:
    """A replayed score has no further move; the game ends as it did there."""

    result: str


Proposal = Propose | TakenBack | Resign | ScoreEnds


class Player(Protocol):
    """A source of moves for one side, or for both."""

    @property
    def spec(self) -> PlayerSpec:
        """Name and what is needed to set the player up again."""
        ...

    async def propose(self, board: chess.Board, on_thinking: OnThinking) -> Proposal:
        """What to do in this position.

        May be cancelled at any time (takeback, another mode); the player is then ready to be asked again.

        Args:
            board: A copy, with the game so far on its move stack.
            on_thinking: Called with each new thought.
        """
        ...

    async def answer_draw(self, board: chess.Board) -> bool:
        """Whether to agree to the draw that the opponent offers. May be cancelled: the offer has lapsed."""
        ...


class EnginePlayer:
    """A program that thinks.

    Args:
        engine: Entered and left by whoever made it.
        seconds: Time for a move; None: the engine's own.
        details: Whatever sets up the same engine again.
        resign_below: Centipawns, from the engine's side, at which it gives up; None: never.
        time_left: Tells its time on the clock, s; None without a clock.
    """

    def __init__(
        self,
        engine: Engine,
        *,
        name: str = "",
        seconds: float | None = None,
        details: Mapping[str, JsonValue] | None = None,
        resign_below: int | None = None,
        time_left: Callable[[chess.Color], float | None] = lambda _: None,
    ) -> None:
        self._engine = engine
        self._seconds = seconds
        self._time_left = time_left
        self._resign_below = resign_below
        self._last: Thinking | None = None
        self._offers_draw = False
        self.spec = PlayerSpec(kind="engine", name=name or engine.name, details=dict(details or {}))

    async def propose(self, board: chess.Board, on_thinking: OnThinking) -> Proposal:
        """The engine's choice."""
        seconds = self._affordable(board.turn)
        choice = await self._engine.choose(board, seconds=seconds, on_thinking=on_thinking)
        self._last, self._offers_draw = choice.thinking, choice.offers_draw
        if choice.resigns or self._hopeless(choice.thinking):
            return Resign()
        return Propose(choice.move)

    def _affordable(self, colour: chess.Color) -> float | None:
        """Time for a move, s: the usual one, or less where the clock would not last."""
        left = self._time_left(colour)
        if left is None or self._seconds is None:
            return self._seconds
        return max(min(self._seconds, left / MOVES_TO_GO), LEAST_S)

    async def answer_draw(self, board: chess.Board) -> bool:
        """Agreed where the engine has offered one itself, or late in a game in which it sees no chance."""
        if self._offers_draw:
            return True
        thinking = self._last
        if thinking is None:
            return False
        if thinking.mate is not None:
            return thinking.mate < 0
        late = board.fullmove_number >= DRAW_FROM_MOVE
        return late and thinking.centipawns is not None and thinking.centipawns <= DRAW_MARGIN

    def _hopeless(self, thinking: Thinking) -> bool:
        if self._resign_below is None or thinking.centipawns is None:
            return False
        return thinking.centipawns < self._resign_below


class ReplayPlayer:
    """The moves of a recorded game, for one side or for both."""

    def __init__(self, score: GameScore, *, name: str) -> None:
        self.score = score
        moves = " ".join(move.uci() for move in score.moves)
        details: dict[str, JsonValue] = {
            "start_fen": score.start_fen,
            "moves": moves,
            "result": score.result,
        }
        self.spec = PlayerSpec(kind="replay", name=name, details=details)

    @classmethod
    def from_spec(cls, spec: PlayerSpec) -> "ReplayPlayer":
        """The same player again, from the journal.

        Raises:
            NotationError: The details are not those of a replay.
        """
        try:
            moves = tuple(chess.Move.from_uci(uci) for uci in str(spec.details["moves"]).split())
            fen, result = str(spec.details["start_fen"]), str(spec.details["result"])
        except (KeyError, ValueError) as error:
            raise NotationError(f"The replay '{spec.name}' cannot be set up again: {error!r}.") from error
        return cls(GameScore(headers={}, start_fen=fen, moves=moves, result=result), name=spec.name)

    async def propose(self, board: chess.Board, on_thinking: OnThinking) -> Proposal:  # noqa: ARG002 - asked of all
        """The score's next move.

        Raises:
            NotationError: The game so far is not the score's, so that it has no next move here.
        """
        played = tuple(board.move_stack)
        if played != self.score.moves[: len(played)] or board.root().fen() != self.score.start_board().fen():
            raise NotationError(
                f"The game has left the score of '{self.spec.name}', which has no move for this position.",
                hint="Take moves back to where they part, or swap to another mode.",
            )
        if len(played) == len(self.score.moves):
            return ScoreEnds(self.score.result)
        return Propose(self.score.moves[len(played)])

    async def answer_draw(self, board: chess.Board) -> bool:  # noqa: ARG002 - asked of all
        """Never: the score decides."""
        return False


class PersonPlayer:
    """A person who writes moves, at the terminal or on a page.

    Whoever reads what the person writes calls `submit`, and `answer` when a draw was offered.

    Attributes:
        wanted: Set while a move or an answer is waited for.
        changed: Called whenever something is waited for, or no more.
    """

    def __init__(self, name: str = "Person") -> None:
        self.spec = PlayerSpec(kind="person", name=name)
        self._board: chess.Board | None = None
        self._moves: asyncio.Queue[chess.Move] = asyncio.Queue(maxsize=1)
        self._draw: asyncio.Future[bool] | None = None
        self.wanted = asyncio.Event()
        self.changed: Callable[[], None] = lambda: None

    @property
    def to_move(self) -> bool:
        """Whether a move is waited for."""
        return self._board is not None

    @property
    def offered_draw(self) -> bool:
        """Whether an answer to a draw offer is waited for."""
        return self._draw is not None

    def submit(self, text: str) -> chess.Move:
        """Take a move in any notation (`kempelen.game.notation.parse_move`).

        Raises:
            NotationError: It is not this person's turn, or the move is unreadable, illegal or ambiguous.
        """
        if self._board is None:
            raise NotationError(
                say(
                    "not_your_turn",
                    f"It is not {self.spec.name}'s turn, so '{text.strip()[:24]}' cannot be played.",
                ),
                hint=say("wait_your_turn", "Wait until the other side has moved."),
            )
        move = parse_move(text, self._board)
        self._board = None
        self._tell()
        self._moves.put_nowait(move)
        return move

    def answer(self, *, agree: bool) -> None:
        """Answer the opponent's draw offer.

        Raises:
            NotationError: No offer is open.
        """
        if self._draw is None or self._draw.done():
            raise NotationError(say("no_draw", "No draw is on offer."))
        self._draw.set_result(agree)

    async def propose(self, board: chess.Board, on_thinking: OnThinking) -> Proposal:  # noqa: ARG002 - asked of all
        """The move that the person writes."""
        self._board = board
        self._tell()
        try:
            return Propose(await self._moves.get())
        finally:
            self._board = None
            self._tell()
            while not self._moves.empty():
                self._moves.get_nowait()

    async def answer_draw(self, board: chess.Board) -> bool:  # noqa: ARG002 - asked of all
        """What the person answers."""
        self._draw = asyncio.get_running_loop().create_future()
        self._tell()
        try:
            return await self._draw
        finally:
            self._draw = None
            self._tell()

    def _tell(self) -> None:
        if self.to_move or self.offered_draw:
            self.wanted.set()
        else:
            self.wanted.clear()
        self.changed()

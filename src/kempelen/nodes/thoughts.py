"""What an engine's node and whoever asks it say to each other."""

from typing import Annotated, Literal

import chess
from pydantic import Field

from kempelen.core.errors import LinkError
from kempelen.core.protocols import EngineChoice, Thinking
from kempelen.nodes.messages import Message, Number, Trouble

_Uci = Annotated[str, Field(min_length=4, max_length=5)]
_LONGEST_GAME = 6000
"""Half-moves: longer ones the rules do not allow."""


class Introduce(Message):
    """Who is there?"""


class Introduced(Message):
    """An engine.

    Attributes:
        name: With its level.
    """

    name: Annotated[str, Field(max_length=200)]


class Think(Message):
    """A position to find a move for.

    Attributes:
        client: Of the asking program's own making.
        number: Rises with each position; the same number is the same question, asked again.
        forget: The move is not wanted any more.
    """

    client: Annotated[str, Field(min_length=8, max_length=64)]
    number: Annotated[int, Field(ge=1)]
    start: Annotated[str, Field(max_length=120)] = chess.STARTING_FEN
    moves: Annotated[tuple[_Uci, ...], Field(max_length=_LONGEST_GAME)] = ()
    seconds: Number | None = None
    forget: bool = False

    def board(self) -> chess.Board:
        """The position, with the game so far.

        Raises:
            LinkError: there is no such game.
        """
        try:
            board = chess.Board(self.start)
            for uci in self.moves:
                board.push_uci(uci)
        except ValueError as error:
            raise LinkError(f"The game that was sent cannot be: {error}.") from None
        return board


class ThinkingMessage(Message):
    """`kempelen.core.protocols.Thinking`."""

    depth: int = 0
    centipawns: int | None = None
    mate: int | None = None
    line: tuple[_Uci, ...] = ()
    nodes: int = 0
    adapted: int | None = None

    @classmethod
    def of(cls, thinking: Thinking) -> "ThinkingMessage":
        """As it travels."""
        return cls(
            depth=thinking.depth, centipawns=thinking.centipawns, mate=thinking.mate, nodes=thinking.nodes,
            line=tuple(move.uci() for move in thinking.line), adapted=thinking.adapted,
        )  # fmt: skip

    def thinking(self) -> Thinking:
        """What it means.

        Raises:
            LinkError: a move of its line is none.
        """
        try:
            line = tuple(map(chess.Move.from_uci, self.line))
        except ValueError as error:
            raise LinkError(f"An engine's thought cannot be read: {error}.") from None
        return Thinking(self.depth, self.centipawns, self.mate, line, self.nodes, self.adapted)


class Thought(Message):
    """What has come of it so far.

    Attributes:
        move: Once it is done; "0000" when the engine gives up.
    """

    number: int
    status: Literal["running", "done", "failed"]
    move: Annotated[str, Field(max_length=5)] = ""
    thinking: ThinkingMessage | None = None
    resigns: bool = False
    offers_draw: bool = False
    trouble: Trouble | None = None

    def choice(self, board: chess.Board) -> EngineChoice:
        """The move.

        Raises:
            LinkError: it is none, or illegal on ``board``.
        """
        thinking = self.thinking.thinking() if self.thinking else Thinking()
        if self.resigns:
            return EngineChoice(chess.Move.null(), thinking, resigns=True)
        try:
            move = board.parse_uci(self.move)
        except ValueError:
            raise LinkError(f"'{self.move}' is no legal move in {board.fen()}.") from None
        return EngineChoice(move, thinking, offers_draw=self.offers_draw)


class Musing(Message):
    """News: what an engine thinks at the moment."""

    client: str
    number: int
    thinking: ThinkingMessage

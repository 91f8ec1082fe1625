"""Players whose moves are known beforehand."""

from collections.abc import Iterable

import chess

from kempelen.core.protocols import OnThinking, Thinking
from kempelen.game.players import Proposal, Propose, Resign
from kempelen.game.records import PlayerSpec


class ScriptedPlayer:
    """Plays given moves, by position, so that it can be asked again after a restart; resigns when they end.

    Args:
        moves: Moves in SAN or UCI, of both sides, from the game's beginning.
        agrees: What it answers to a draw offer.
    """

    def __init__(self, moves: Iterable[str], *, name: str = "Script", agrees: bool = False) -> None:
        self._moves = tuple(moves)
        self._agrees = agrees
        self.spec = PlayerSpec(kind="script", name=name)

    async def propose(self, board: chess.Board, on_thinking: OnThinking) -> Proposal:
        """The move of this ply."""
        on_thinking(Thinking(depth=1))
        ply = len(board.move_stack)
        return Propose(board.parse_san(self._moves[ply])) if ply < len(self._moves) else Resign()

    async def answer_draw(self, board: chess.Board) -> bool:
        """As told."""
        del board
        return self._agrees

"""The moves of a game as pages show them, each worked out once."""

from dataclasses import dataclass, field

import chess

from kempelen.server.topics import Colour, MoveView


def colour_of(colour: chess.Color) -> Colour:
    """As messages have it."""
    return "white" if colour else "black"


@dataclass
class MoveBook:
    """Follows a game: what is the same as before is not worked out again."""

    _start: str = ""
    _board: chess.Board = field(default_factory=chess.Board)
    _moves: list[MoveView] = field(default_factory=list)
    _captured: list[chess.Piece | None] = field(default_factory=list)

    def moves(self, board: chess.Board) -> tuple[MoveView, ...]:
        """All moves of ``board``, which is not changed."""
        self._follow(board)
        return tuple(self._moves)

    def captured(self, board: chess.Board) -> dict[Colour, str]:
        """Letters of the pieces that were taken, as in FEN, of each colour."""
        self._follow(board)
        taken = [piece for piece in self._captured if piece is not None]
        return {
            "white": "".join(piece.symbol() for piece in taken if piece.color),
            "black": "".join(piece.symbol() for piece in taken if not piece.color),
        }

    def _follow(self, board: chess.Board) -> None:
        start = board.root().fen()
        if start != self._start:
            self._start, self._board = start, chess.Board(start)
            self._moves, self._captured = [], []
        known, wanted = self._board.move_stack, board.move_stack
        while known != wanted[: len(known)]:
            self._board.pop()
            self._moves.pop()
            self._captured.pop()
        for move in wanted[len(known) :]:
            self._add(move)

    def _add(self, move: chess.Move) -> None:
        board, san = self._board, self._board.san(move)
        victim = move.to_square
        if board.is_en_passant(move):
            victim = chess.square(chess.square_file(move.to_square), chess.square_rank(move.from_square))
        taken = board.piece_at(victim) if board.is_capture(move) else None
        board.push(move)
        self._captured.append(taken)
        self._moves.append(MoveView(ply=len(board.move_stack), san=san, uci=move.uci(), fen=board.fen()))

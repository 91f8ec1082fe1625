"""The board as a terminal shows it."""

from collections.abc import Iterable

import chess
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

_LIGHT = "on #f0d9b5"
_DARK = "on #b58863"
_LAST_LIGHT = "on #cdd26a"
_LAST_DARK = "on #aaa23a"
_GLYPHS = {"k": "♚", "q": "♛", "r": "♜", "b": "♝", "n": "♞", "p": "♟"}


def _square_style(board: chess.Board, square: chess.Square) -> str:
    dark = (chess.square_file(square) + chess.square_rank(square)) % 2 == 0
    last = board.peek() if board.move_stack else None
    if last is not None and square in (last.from_square, last.to_square):
        return _LAST_DARK if dark else _LAST_LIGHT
    return _DARK if dark else _LIGHT


def _cell(board: chess.Board, square: chess.Square) -> Text:
    piece = board.piece_at(square)
    glyph = _GLYPHS[piece.symbol().lower()] if piece else " "
    colour = "bold #ffffff" if piece and piece.color else "bold #000000"
    return Text(f" {glyph} ", style=f"{colour} {_square_style(board, square)}")


def board_picture(board: chess.Board, *, flipped: bool = False) -> Text:
    """Eight rows with coordinates, the last move highlighted."""
    ranks: Iterable[int] = range(8) if flipped else range(7, -1, -1)
    files = list(range(7, -1, -1) if flipped else range(8))
    picture = Text()
    for rank in ranks:
        picture.append(f"{rank + 1} ", style="dim")
        for file in files:
            picture.append_text(_cell(board, chess.square(file, rank)))
        picture.append("\n")
    picture.append("   " + "  ".join(chess.FILE_NAMES[f] for f in files), style="dim")
    return picture


def move_log(board: chess.Board, rows: int = 9) -> Text:
    """The last moves in SAN, a line for each full move."""
    replay = board.root()
    lines: list[str] = []
    for move in board.move_stack:
        san = replay.san(move)
        if replay.turn or not lines:
            lines.append(f"{replay.fullmove_number:>3}. {san if replay.turn else '…   ' + san}")
        else:
            lines[-1] = f"{lines[-1]:<13}{san}"
        replay.push(move)
    return Text("\n".join(lines[-rows:]) or "No move yet.")


def game_picture(board: chess.Board, status: RenderableType, *, flipped: bool = False) -> RenderableType:
    """Board at the left; log and status at the right."""
    grid = Table.grid(padding=(0, 3))
    grid.add_row(board_picture(board, flipped=flipped), Group(move_log(board), Text(), status))
    return grid

"""The board as a terminal shows it: in colours, or in letters where there are none."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

import chess
from rich.console import Console
from rich.text import Text

WIDTH = 26
HEIGHT = 9

_LIGHT, _DARK = "on #b59b73", "on #83603f"
_LAST_LIGHT, _LAST_DARK = "on #a3a95a", "on #7c8438"
_GLYPHS = {"k": "♚", "q": "♛", "r": "♜", "b": "♝", "n": "♞", "p": "♟"}


@dataclass(frozen=True)
class Look:
    """What the terminal can show.

    Attributes:
        colours: Squares are painted; else the last move stands in brackets and empty squares are dots.
        glyphs: Chess figures; else letters, White's in capitals.
    """

    colours: bool = True
    glyphs: bool = True

    @classmethod
    def of(cls, console: Console) -> "Look":
        """Figures need many colours too: the text consoles that have sixteen lack the figures."""
        rich = console.color_system in {"256", "truecolor"} and not console.no_color
        return cls(colours=rich, glyphs=rich and console.encoding.lower().replace("-", "") == "utf8")


def piece_sign(piece: chess.Piece, look: Look) -> str:
    """A figure, or a letter."""
    return _GLYPHS[piece.symbol().lower()] if look.glyphs else piece.symbol()


def _paint(square: chess.Square, piece: chess.Piece | None, marked: bool) -> str:
    dark = (chess.square_file(square) + chess.square_rank(square)) % 2 == 0
    ground = (_LAST_DARK if dark else _LAST_LIGHT) if marked else (_DARK if dark else _LIGHT)
    return f"bold {'#ffffff' if piece and piece.color else '#000000'} {ground}"


def _cell(square: chess.Square, piece: chess.Piece | None, marked: bool, look: Look) -> Text:
    if look.colours:
        sign = piece_sign(piece, look) if piece else " "
        return Text(f" {sign} ", style=_paint(square, piece, marked))
    sign = piece_sign(piece, look) if piece else "."
    return Text(f"[{sign}]" if marked else f" {sign} ")


def board_picture(
    pieces: Mapping[chess.Square, chess.Piece],
    marked: Collection[chess.Square] = (),
    *,
    flipped: bool = False,
    look: Look | None = None,
) -> Text:
    """Eight rows with coordinates, `WIDTH` by `HEIGHT` characters.

    Args:
        pieces: What stands where.
        marked: Squares to stand out: those of the move at hand or of the last one.
        flipped: Whether Black sits at the bottom.
        look: What the terminal can show.
    """
    ranks: Iterable[int] = range(8) if flipped else range(7, -1, -1)
    files = list(range(7, -1, -1) if flipped else range(8))
    picture = Text()
    for rank in ranks:
        picture.append(f"{rank + 1} ", style="dim")
        for square in (chess.square(file, rank) for file in files):
            picture.append_text(_cell(square, pieces.get(square), square in marked, look or Look()))
        picture.append("\n")
    picture.append("   " + "  ".join(chess.FILE_NAMES[f] for f in files) + " ", style="dim")
    return picture

"""What an engine says in the Chess Engine Communication Protocol (xboard, protocol versions 1 and 2).

Source: "Chess Engine Communication Protocol", Tim Mann and H. G. Muller (https://hgm.nubati.net/CECP.html).
    Programs of forty years speak it, each with an accent: moves come as ``move e7e5``, ``move e8=Q``, ``1.
    ... e7-e5`` or ``My move is : O-O``, behind a prompt or not.
"""

import re
import shlex
from dataclasses import dataclass

import chess
import chess.engine

from kempelen.core.protocols import Thinking

_PROMPT = re.compile(r"^(?:(?:White|Black) \(\d+\)\s*:\s*)+")
_MOVE = re.compile(r"(?:move|(?:My|my) move is\s*:|\d+\s*\.?\s*\.\.\.)\s*(?P<move>\S+)\s*$")
_RESULT = re.compile(r"(?P<result>1-0|0-1|1/2-1/2)\b(?P<why>.*)")
_REFUSED = re.compile(r"(?:illegal move|invalid move|error\b)[^:]*:\s*(?P<what>.*)", re.IGNORECASE)
_POST = re.compile(r"(?P<depth>\d+)[.&+]?\s+(?P<score>[+-]?\d+)\s+\d+\s+(?P<nodes>\d+)(?:\s+(?P<line>.*))?$")
_MOVE_NUMBER = re.compile(r"^\d+\.+")
_MATE, _LONGEST_MATE = 100_000, 500  # a score of the one plus n is a mate in n
_PAWN_TO_LAST = re.compile(r"[a-h][27][a-h][18]")


@dataclass(frozen=True, slots=True)
class Verdict:
    """A result that an engine claims.

    Attributes:
        result: ``1-0``, ``0-1`` or ``1/2-1/2``.
        resigned: It says that a side gives up.
    """

    result: str
    resigned: bool


def without_prompt(line: str) -> str:
    """The line without the prompts that some engines go on printing."""
    return _PROMPT.sub("", line.strip())


def parse_features(line: str) -> dict[str, list[str]]:
    """The values of a ``feature`` line by name (``option`` comes many times); none for any other line."""
    word, _, rest = line.partition(" ")
    if word != "feature":
        return {}
    try:
        words = shlex.split(rest)
    except ValueError:  # a quotation mark left open
        words = rest.split()
    found: dict[str, list[str]] = {}
    for name, equals, value in (word.partition("=") for word in words):
        if equals:
            found.setdefault(name, []).append(value)
    return found


def parse_option(text: str) -> chess.engine.Option | None:
    """An option as in ``Resign Threshold -spin 800 200 1200``; None where it cannot be understood."""
    name, dash, rest = text.partition(" -")
    kind, *values = rest.split(" ") if dash else [""]
    if kind in {"spin", "slider"} and len(values) >= 3:  # noqa: PLR2004 - default, least, most
        try:
            usual, least, most = (int(value) for value in values[:3])
        except ValueError:
            return None
        return chess.engine.Option(name, "spin", usual, least, most, None)
    if kind == "check":
        return chess.engine.Option(name, "check", values[:1] == ["1"], None, None, None)
    if kind == "combo":
        choices = [choice.strip() for choice in " ".join(values).split("///")]
        marked = [choice.lstrip("*") for choice in choices if choice.startswith("*")]
        names = [choice.lstrip("*") for choice in choices]
        return chess.engine.Option(name, "combo", (marked or names)[0], None, None, names)
    if kind in {"string", "file", "path"}:
        return chess.engine.Option(name, kind, " ".join(values), None, None, None)
    return None


def parse_move(text: str, board: chess.Board) -> chess.Move | None:
    """The legal move that an engine means: ``e7e5``, ``e7-e5``, ``Ng8-f6``, ``exd8=Q+``, ``o-o``; or None."""
    plain = text.strip("!?<>(),;").rstrip("+#")
    if plain.replace("0", "o").lower() in {"o-o", "o-o-o"}:
        plain = plain.replace("0", "O").upper()
    bare = plain.replace("-", "").replace("=", "").lower()
    if _PAWN_TO_LAST.fullmatch(bare) and board.piece_type_at(chess.parse_square(bare[:2])) == chess.PAWN:
        bare += "q"  # an engine that leaves the piece out means a queen
    for parse, word in ((board.parse_uci, bare), (board.parse_san, plain)):
        try:
            move = parse(word)
        except ValueError:
            continue
        if move:
            return move
    return None


def move_text(line: str) -> str | None:
    """What stands for the move in the line by which an engine moves; None for any other line."""
    match = _MOVE.match(line)
    return match["move"] if match else None


def verdict(line: str) -> Verdict | None:
    """The result in a line such as ``0-1 {White resigns}`` or ``resign``; None for any other line."""
    match = _RESULT.match(line.removeprefix("result "))
    if match:
        return Verdict(match["result"], "resign" in match["why"].lower())
    return Verdict("", resigned=True) if line.strip() == "resign" else None


def refused(line: str) -> str | None:
    """What the engine refuses, as in ``Illegal move (pinned): e2e4``; None for any other line."""
    match = _REFUSED.match(line)
    return match["what"].strip() if match else None


def parse_thinking(line: str, board: chess.Board) -> Thinking | None:
    """Read a line of thinking output, ``depth score time nodes line``; None for any other.

    Args:
        line: As the engine sent it; the score is in centipawns from its own side.
        board: The searched position. The variation is cut before what cannot be read as a legal move.
    """
    match = _POST.match(line.strip())
    if match is None:
        return None
    score = int(match["score"])
    distance = abs(score) - _MATE
    mate = (distance if score > 0 else -distance) if 0 <= distance <= _LONGEST_MATE else None
    return Thinking(
        depth=int(match["depth"]),
        centipawns=None if mate is not None else score,
        mate=mate,
        line=_line_of_play(match["line"] or "", board),
        nodes=int(match["nodes"]),
    )


def _line_of_play(text: str, board: chess.Board) -> tuple[chess.Move, ...]:
    after, played = board.copy(stack=False), []
    for word in text.replace("...", " ").split():
        plain = _MOVE_NUMBER.sub("", word)
        if not plain.strip("!?.()<>"):
            continue
        move = parse_move(plain, after)
        if move is None:
            break
        after.push(move)
        played.append(move)
    return tuple(played)


def edit_lines(board: chess.Board) -> list[str] | None:
    """The commands that set a position up without ``setboard``; None where they cannot say it.

    The edit mode knows no castling rights (kings and rooks at home have them) and no en passant. The side to
    move is told by a pawn's move that is made before the pieces are cleared away, which is how xboard itself
    does it.
    """
    told = chess.Board(None)
    told.set_piece_map(board.piece_map())
    told.turn = board.turn
    homes = {chess.A1, chess.H1, chess.A8, chess.H8}
    told.castling_rights = chess.BB_EMPTY
    told.castling_rights = told.rooks & sum(chess.BB_SQUARES[square] for square in homes)
    if told.clean_castling_rights() != board.clean_castling_rights() or board.has_legal_en_passant():
        return None
    men = {
        colour: [
            f"{piece.symbol().upper()}{chess.square_name(square)}"
            for square, piece in board.piece_map().items()
            if piece.color is colour
        ]
        for colour in chess.COLORS
    }
    turn = [] if board.turn is chess.WHITE else ["a2a3"]
    return [*turn, "edit", "#", *men[chess.WHITE], "c", *men[chess.BLACK], "."]

"""What an engine says while it thinks: ``info`` lines (UCI protocol, April 2006) and lc0's policy."""

import re
from dataclasses import dataclass

import chess

from kempelen.core.protocols import Thinking

# "info string e7e5  (322 ) N: 0 (+ 0) (P: 42.30%) …", lc0 with VerboseMoveStats
_POLICY = re.compile(r"info string ([a-h][1-8][a-h][1-8][qrbn]?)\s.*?\(P:\s*([0-9.]+)%\)")
_NUMBERS = frozenset({"depth", "multipv", "nodes", "cp", "mate"})


@dataclass(frozen=True, slots=True)
class Thought:
    """One line of MultiPV at one moment.

    Attributes:
        rank: Number of the line, the best is 1.
    """

    rank: int
    thinking: Thinking


def parse_info(line: str, board: chess.Board) -> Thought | None:
    """Read an ``info`` line with a score; None for any other (progress, free text, damaged numbers).

    Args:
        line: As the engine sent it.
        board: The searched position. The variation is cut before its first illegal move.
    """
    words = line.split()
    numbers: dict[str, int] = {}
    line_of_play: tuple[chess.Move, ...] = ()
    for index, word in enumerate(words[:-1]):
        if word == "string":
            break
        if word == "pv":
            line_of_play = _legal_line(words[index + 1 :], board)
            break
        if word in _NUMBERS and (number := _integer(words[index + 1])) is not None:
            numbers[word] = number
    if "cp" not in numbers and "mate" not in numbers:
        return None
    thinking = Thinking(
        depth=numbers.get("depth", 0),
        centipawns=None if "mate" in numbers else numbers["cp"],
        mate=numbers.get("mate"),
        line=line_of_play,
        nodes=numbers.get("nodes", 0),
    )
    return Thought(numbers.get("multipv", 1), thinking)


def parse_policy(line: str, board: chess.Board) -> tuple[chess.Move, float] | None:
    """Read a line of lc0's move statistics: a legal move and its probability 0..1; None for any other."""
    match = _POLICY.match(line)
    if match is None:
        return None
    try:
        # The board's parser also knows lc0's castling, the king onto its rook.
        return board.parse_uci(match[1]), float(match[2]) / 100.0
    except ValueError:
        return None


def _integer(word: str) -> int | None:
    try:
        return int(word)
    except ValueError:
        return None


def _legal_line(words: list[str], board: chess.Board) -> tuple[chess.Move, ...]:
    after = board.copy(stack=False)
    played = []
    for word in words:
        try:
            move = after.parse_uci(word)
        except ValueError:
            break
        after.push(move)
        played.append(move)
    return tuple(played)

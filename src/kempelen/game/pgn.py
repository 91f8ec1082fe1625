"""Reading games in Portable Game Notation (PGN 1994).

The main line is read and every move of it checked; comments, annotation glyphs and variations are passed
over. Nothing is skipped in silence: what cannot be read or played is an error that names game, line and move.
"""

import io
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import BinaryIO

import chess

from kempelen.core.errors import NotationError
from kempelen.game.fen import parse_fen
from kempelen.game.notation import parse_move, quoted, readable
from kempelen.game.pgn_scan import DEFAULT_LIMITS, PgnLimits, RawGame, raw_games

RESULTS = ("1-0", "0-1", "1/2-1/2", "*")
_STANDARD_VARIANTS = frozenset({"", "standard", "normal", "chess", "from position", "classical"})
_TAG = re.compile(r'\[\s*([A-Za-z0-9_]+)\s+"((?:[^"\\]|\\.)*)"\s*\]')
_SLOPPY_TAG = re.compile(r'\[\s*([A-Za-z0-9_]+)\s+"(.*)"\s*\]')
_ESCAPED = re.compile(r"\\([\"\\])")
_CONTROL = re.compile(r"[\x00-\x08\x0e-\x19\x1c-\x1f]")
_SHOWN = 40  # characters of a faulty text that are repeated in a message

# The order matters: a result is no move, a move number no ICCF move, "e8(Q)" no variation.
_TOKEN = re.compile(
    r"""
    (?P<blank>[\s\x1a\ufeff]+)
  | (?P<comment>\{[^}]*\}|;[^\n]*|^%[^\n]*)
  | (?P<unclosed>\{)
  | (?P<opened>\()
  | (?P<closed>\))
  | (?P<result>(?:1-0|0-1|1/2-1/2|½-½|\*)(?![\w/-]))
  | (?P<number>\d+\s*(?:\.+|…)|\d{1,3}(?![\w./-])|\.+|…)
  | (?P<glyph>\$\d*|[!?‼⁇⁉⁈]+|(?:e\.?p\.?|(?!--)[-+=/∓±⩲⩱∞□]+)(?=[\s)]|\Z))
  | (?P<move>[^\s{}();$]+(?:\([QRBNqrbn]\))?[+\#!?]*)
  | (?P<other>.)
    """,
    re.VERBOSE | re.MULTILINE,
)


@dataclass(frozen=True, slots=True)
class GameHeading:
    """What a list of games shows.

    Attributes:
        index: Number of the game in its file, from 1.
        line: Where it begins, from 1.
        headers: Its tags in the file's order.
    """

    index: int
    line: int
    headers: Mapping[str, str]

    @property
    def title(self) -> str:
        """Players, result, event and date as far as they are known, in one line."""
        return title(self.headers)


@dataclass(frozen=True, slots=True)
class GameScore:
    """A game as it was played.

    Attributes:
        headers: Its tags in the file's order.
        start_fen: The position of the first move.
        moves: Of the main line; legal one after the other.
        result: ``1-0``, ``0-1``, ``1/2-1/2`` or ``*``.
        index: Number of the game in its file, from 1.
        line: Where it begins, from 1.
    """

    headers: Mapping[str, str]
    start_fen: str
    moves: tuple[chess.Move, ...]
    result: str = "*"
    index: int = 1
    line: int = 1

    @property
    def title(self) -> str:
        """Players, result, event and date as far as they are known, in one line."""
        return title(self.headers)

    def start_board(self) -> chess.Board:
        """A new board at the start of the game."""
        return chess.Board(self.start_fen)

    def final_board(self) -> chess.Board:
        """A new board with all the moves played; its move stack is the game."""
        board = self.start_board()
        for move in self.moves:
            board.push(move)
        return board


def title(headers: Mapping[str, str]) -> str:
    """Players, result, event and date as far as they are known, in one line."""
    players = f"{headers.get('White') or '?'} vs {headers.get('Black') or '?'}"
    known = (headers.get(tag, "") for tag in ("Result", "Event", "Date"))
    text = ", ".join([players, *(value for value in known if value.strip("?.* "))])
    return "".join(letter for letter in text if letter.isprintable())  # a tag must not steer the terminal


def read_game(
    path: str | os.PathLike[str], number: int = 1, *, limits: PgnLimits = DEFAULT_LIMITS
) -> GameScore:
    """Read game ``number`` (from 1) of a file; no more of the file is read than up to its end.

    Raises:
        NotationError: The file cannot be opened, is no PGN file, has no such game, or the game is truncated,
            has an illegal or unreadable move, or is beyond the limits; the message says where.
    """
    where = os.fspath(path)
    with _opened(where) as stream:
        return _read(stream, where, number, limits)


def parse_game(text: str, number: int = 1, *, limits: PgnLimits = DEFAULT_LIMITS) -> GameScore:
    """Read game ``number`` (from 1) of a PGN text.

    Raises:
        NotationError: As for `read_game`.
    """
    return _read(io.BytesIO(text.encode()), "the PGN text", number, limits)


def list_games(path: str | os.PathLike[str], *, limits: PgnLimits = DEFAULT_LIMITS) -> Iterator[GameHeading]:
    """The games of a file one after the other, as fast as their lines can be told apart.

    Raises:
        NotationError: The file cannot be opened, is no text, has no game, or a limit is passed.
    """
    where = os.fspath(path)
    with _opened(where) as stream:
        yield from headings(stream, where, limits=limits)


def headings(stream: BinaryIO, where: str, *, limits: PgnLimits = DEFAULT_LIMITS) -> Iterator[GameHeading]:
    """As `list_games`, of what is open already; ``where`` names it in messages."""
    index = 0
    for game in raw_games(stream, where=where, wanted=lambda _: False, limits=limits):
        index = game.index
        if index > limits.games:
            raise NotationError(f"{where} has more than {limits.games} games.", hint="Split the file.")
        headers, _, _ = _headers(_decoded(game.lines))
        yield GameHeading(index, game.line, headers)
    if index == 0:
        raise _empty(where)


@contextmanager
def _opened(where: str) -> Iterator[BinaryIO]:
    try:
        with Path(where).open("rb") as stream:
            yield stream
    except FileNotFoundError as error:
        raise NotationError(f"There is no file {where}.", hint="Check the name.") from error
    except IsADirectoryError as error:
        raise NotationError(f"{where} is a directory, not a PGN file.", hint="Name a file in it.") from error
    except OSError as error:
        why = error.strerror or str(error)
        raise NotationError(
            f"{where} cannot be read: {why}.", hint="Check the file and its permissions."
        ) from error


def _read(stream: BinaryIO, where: str, number: int, limits: PgnLimits) -> GameScore:
    if number < 1:
        raise NotationError(f"There is no game {number} in {where}.", hint="Games are counted from 1.")
    count = 0
    for game in raw_games(stream, where=where, wanted=number.__eq__, limits=limits):
        count = game.index
        if count == number:
            return _GameReader(game, where, limits).read()
    if count == 0:
        raise _empty(where)
    games = "1 game" if count == 1 else f"{count} games"
    raise NotationError(f"{where} has {games}; there is no game {number}.", hint=f"Name one of 1..{count}.")


def _empty(where: str) -> NotationError:
    return NotationError(f"{where} is empty: there is no game in it.", hint="Name a PGN file with a game.")


def _decoded(lines: Iterable[bytes]) -> list[str]:
    """UTF-8, else Latin-1, the same for the whole game: old files are Latin-1, and Latin-1 never fails."""
    raw = b"".join(lines)
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    return re.split(r"\r\n|\n|\r", text)


def _headers(lines: list[str]) -> tuple[Mapping[str, str], list[int], int]:
    """Tags, indices of lines that look like tags but are none, and the index where the move text begins."""
    tags: dict[str, str] = {}
    faulty = []
    for index, line in enumerate(lines):
        bare = line.strip()
        if bare.startswith("["):
            found = _TAG.findall(bare)
            if not found or _TAG.sub("", bare).strip():
                sloppy = _SLOPPY_TAG.fullmatch(bare)
                found = [sloppy.groups()] if sloppy else []
            faulty += [] if found else [index]
            tags.update((name, _ESCAPED.sub(r"\1", value)) for name, value in found)
        elif bare and bare[0] not in "%;":
            return MappingProxyType(tags), faulty, index
    return MappingProxyType(tags), faulty, len(lines)


class _GameReader:
    """Reads one game, token by token."""

    def __init__(self, game: RawGame, where: str, limits: PgnLimits) -> None:
        self._game = game
        self._where = where
        self._limits = limits
        lines = _decoded(game.lines)
        self._headers, self._faulty, begin = _headers(lines)
        self._text = "\n".join(lines[begin:])
        self._first_line = game.line + begin
        self._board = chess.Board()
        self._moves: list[chess.Move] = []
        self._variations: list[int] = []  # where each open one began
        self._result = ""

    def read(self) -> GameScore:
        """The whole game, or the first fault in it."""
        if self._faulty:
            raise self._error_in_line(self._game.line + self._faulty[0], "this tag cannot be read", _TAG_HINT)
        self._board = self._start()
        start_fen = self._board.fen()
        for token in _TOKEN.finditer(self._text):
            self._take(token)
        self._check_complete()
        return GameScore(
            self._headers,
            start_fen,
            tuple(self._moves),
            self._result or "*",
            self._game.index,
            self._game.line,
        )

    def _start(self) -> chess.Board:
        variant = self._headers.get("Variant", "")
        if variant.strip().lower() not in _STANDARD_VARIANTS:
            raise self._error_in_line(
                self._game.line,
                f"the game is {quoted(variant, _SHOWN)}",
                "Only standard chess can be played.",
            )
        fen = self._headers.get("FEN")
        if fen is None or self._headers.get("SetUp") == "0":
            return chess.Board()
        try:
            return parse_fen(fen)
        except NotationError as error:
            raise self._error_in_line(self._game.line, error.message, error.hint) from error

    def _take(self, token: re.Match[str]) -> None:
        kind, text = token.lastgroup, token.group()
        if kind in {"blank", "comment"}:
            return
        if kind == "unclosed":
            raise self._error(token.start(), "the comment that begins here is never closed", _CUT_HINT)
        if kind == "opened":
            self._variations.append(token.start())
        elif kind == "closed":
            self._close_variation(token)
        elif self._variations:
            return
        elif self._result:
            raise self._error(
                token.start(), f"{quoted(text, _SHOWN)} follows the result {self._result}", _END_HINT
            )
        elif kind == "result":
            self._result = "1/2-1/2" if text == "½-½" else text
        elif kind in {"move", "other"}:
            self._play(token)

    def _close_variation(self, token: re.Match[str]) -> None:
        if not self._variations:
            raise self._error(token.start(), "')' closes a variation that was never opened", "Remove it.")
        self._variations.pop()

    def _play(self, token: re.Match[str]) -> None:
        if len(self._moves) >= self._limits.plies:
            raise self._error(
                token.start(),
                f"the game has more than {self._limits.plies} plies",
                "No game can be that long.",
            )
        try:
            move = parse_move(token.group(), self._board, any_case=False)
        except NotationError as error:
            raise self._bad_move(token, error) from error
        self._board.push(move)
        self._moves.append(move)

    def _bad_move(self, token: re.Match[str], error: NotationError) -> NotationError:
        if not self._headers and not self._moves and not readable(token.group()):
            shown = quoted(token.group(), _SHOWN)
            return NotationError(
                f"{self._where} is not a PGN file: line {self._line_of(token.start())} has {shown} "
                "where a tag or a move should be.",
                hint='PGN begins with tags like [Event "…"] or with moves like 1. e4 e5.',
            )
        cut = " The text ends here; it may be cut off." if not self._text[token.end() :].strip() else ""
        dots = "." if self._board.turn == chess.WHITE else "..."
        number = f"move {self._board.fullmove_number}{dots}"
        return self._error(token.start(), f"{number} {error.message}{cut}".rstrip("."), error.hint)

    def _check_complete(self) -> None:
        if self._variations:
            raise self._error(
                self._variations[-1], "the variation that begins here is never closed", _CUT_HINT
            )
        claimed = self._headers.get("Result", "*")
        if not self._result and claimed in RESULTS[:3]:
            last = self._board.fullmove_number - (self._board.turn == chess.WHITE)
            raise self._error(
                len(self._text.rstrip()),
                f"the moves end after move {last} without a result, but the tag says {claimed}",
                f"{_CUT_HINT} If the game is complete, add {claimed} at its end.",
            )
        if not self._result and not self._moves:
            raise self._error(len(self._text.rstrip()), "the game has neither moves nor a result", _CUT_HINT)

    def _line_of(self, position: int) -> int:
        return self._first_line + self._text.count("\n", 0, position)

    def _error(self, position: int, what: str, hint: str) -> NotationError:
        return self._error_in_line(self._line_of(position), what, hint)

    def _error_in_line(self, line: int, what: str, hint: str) -> NotationError:
        return NotationError(
            f"{self._where}, game {self._game.index}, line {line}: {what.rstrip('.')}.", hint=hint
        )


_TAG_HINT = 'A tag looks like [White "Morphy, Paul"].'
_CUT_HINT = "The file seems to be cut off: get it again."
_END_HINT = "Begin the next game with a tag or on a new line, or remove what follows."

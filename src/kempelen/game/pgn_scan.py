"""Where the games of a PGN file begin and end, found line by line without keeping more than one game.

The scanner knows just enough of PGN 1994 to tell games apart: tag lines, comments (``{…}``, ``;…``, ``%…``),
variations and result markers. What the lines of one game mean is read by `kempelen.game.pgn`.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import BinaryIO

from kempelen.core.errors import NotationError

_MB = 1 << 20
_TAG_LINE = re.compile(rb"\[\s*[A-Za-z0-9_]+\s+\"")
_EVENT_LINE = re.compile(rb"\[\s*Event\s+\"")
_FIRST_MOVE = re.compile(rb"\s*1\s*\.")
_COMMENT = re.compile(rb"\{[^}]*\}|;.*")
_RESULTS = (b"1-0", b"0-1", b"1/2-1/2", b"*")
_SNIFFED = 4096  # bytes at the start that must look like text
_NOT_TEXT = re.compile(rb"[\x00-\x08\x0e-\x19\x1c-\x1f\x7f]")
_CONTAINERS = {
    b"\x1f\x8b": "gzip",
    b"PK\x03\x04": "zip",
    b"BZh": "bzip2",
    b"\xfd7zXZ": "xz",
    b"7z\xbc\xaf": "7-zip",
    b"\x28\xb5\x2f\xfd": "Zstandard",
}
_BLANK = b" \t\r\n\v\f\x1a"  # Ctrl-Z ends files of the DOS era
_UTF16 = (b"\xff\xfe", b"\xfe\xff")
UTF8_BOM = b"\xef\xbb\xbf"


@dataclass(frozen=True, slots=True)
class PgnLimits:
    """How much work and memory a file may ask for before it is refused.

    Attributes:
        file_bytes: Read at most, to the end of the wanted game or of the list.
        game_bytes: One game with its comments; memory is bounded by it.
        line_bytes: One line.
        games: In a list.
        plies: In the main line of one game; with the 75-move rule none is longer than 11,797.
    """

    file_bytes: int = 2048 * _MB
    game_bytes: int = 4 * _MB
    line_bytes: int = 1 * _MB
    games: int = 1_000_000
    plies: int = 11_800


DEFAULT_LIMITS = PgnLimits()


@dataclass(frozen=True, slots=True)
class RawGame:
    """One game as it stands in the file.

    Attributes:
        index: From 1.
        line: Of its first line in the file, from 1.
        lines: Tag lines, and the move text too where it was asked for.
    """

    index: int
    line: int
    lines: tuple[bytes, ...]


def raw_games(
    stream: BinaryIO,
    *,
    where: str,
    wanted: Callable[[int], bool],
    limits: PgnLimits = DEFAULT_LIMITS,
) -> Iterator[RawGame]:
    """The games of a file in order; of those not ``wanted`` only the tag lines are kept.

    Args:
        stream: Binary, at its beginning; read forward only, no further than asked for.
        where: The file's name for messages.
        wanted: Whether the move text of game number n (from 1) is to be kept.
        limits: What is refused.

    Raises:
        NotationError: The file is binary, compressed or in UTF-16, or a limit is passed.
    """
    splitter = _Splitter(where, wanted, limits)
    for line in _lines(stream, where, limits):
        if finished := splitter.feed(line):
            yield finished
    if finished := splitter.finish():
        yield finished


def _lines(stream: BinaryIO, where: str, limits: PgnLimits) -> Iterator[bytes]:
    line = stream.readline(limits.line_bytes + 1)
    _refuse_unless_text(line[:_SNIFFED], where)
    line = line.removeprefix(UTF8_BOM)
    read = 0
    while line:
        if len(line) > limits.line_bytes:
            raise _too_big(where, f"one line is longer than {limits.line_bytes / _MB:g} MB")
        read += len(line)
        if read > limits.file_bytes:
            raise _too_big(where, f"the game was not found in the first {limits.file_bytes / _MB:g} MB")
        if b"\r" in line:
            yield from line.splitlines(keepends=True)  # CRLF, and the lone CR of the old Macintosh
        else:
            yield line
        line = stream.readline(limits.line_bytes + 1)


def _refuse_unless_text(head: bytes, where: str) -> None:
    for magic, kind in _CONTAINERS.items():
        if head.startswith(magic):
            raise NotationError(f"{where} is a {kind} archive, not a PGN file.", hint="Unpack it first.")
    if head.startswith(_UTF16):
        raise NotationError(f"{where} is written in UTF-16.", hint="Save it as UTF-8 or Latin-1.")
    if _NOT_TEXT.search(head):
        raise NotationError(f"{where} is a binary file, not PGN text.", hint="Name a PGN file.")


def _too_big(where: str, what: str) -> NotationError:
    return NotationError(
        f"{where} is too big: {what}.", hint="Cut the wanted game out into a file of its own, and try that."
    )


class _Splitter:
    """Fed line by line; hands out a game when the next one begins.

    A new game begins at a tag line that follows move text; after a result marker, at anything but a comment;
    and where no result was given, at a first move after a blank line.
    """

    def __init__(self, where: str, wanted: Callable[[int], bool], limits: PgnLimits) -> None:
        self._where = where
        self._wanted = wanted
        self._limits = limits
        self._line = 0
        self._index = 0
        self._begin()

    def _begin(self) -> None:
        self._index += 1
        self._keep = self._wanted(self._index)
        self._kept: list[bytes] = []
        self._bytes = 0
        self._first_line = 0
        self._in_moves = False
        self._in_comment = False
        self._depth = 0  # of variations
        self._ended = False  # a result marker was seen
        self._blank_before = False
        self._event_seen = False

    def feed(self, line: bytes) -> RawGame | None:
        """Take the next line; the game before it, if this line begins another one."""
        self._line += 1
        finished = None
        if self._begins_game(line):
            finished = self.finish()
        self._take(line)
        return finished

    def finish(self) -> RawGame | None:
        """The game at hand, complete as far as it goes; None when there is none."""
        game = RawGame(self._index, self._first_line, tuple(self._kept)) if self._first_line else None
        if game:
            self._begin()
        return game

    def _begins_game(self, line: bytes) -> bool:
        if not self._first_line:
            return False
        if line[:1] == b"[" and _TAG_LINE.match(line):
            return self._tag_begins_game(line)
        if self._in_comment or line[:1] == b"%":
            return False
        if self._ended:
            return bool(_COMMENT.sub(b"", line).partition(b"{")[0].strip(_BLANK))
        return self._blank_before and self._in_moves and self._depth == 0 and bool(_FIRST_MOVE.match(line))

    def _tag_begins_game(self, line: bytes) -> bool:
        if self._in_comment:
            # A comment may quote a tag; after a blank line it is one that somebody forgot to close.
            return self._blank_before and bool(_EVENT_LINE.match(line))
        if self._in_moves:
            return True
        return self._event_seen and self._blank_before and bool(_EVENT_LINE.match(line))

    def _take(self, line: bytes) -> None:
        blank = not line.strip(_BLANK)
        if not blank:
            self._first_line = self._first_line or self._line
            self._digest(line)
        self._blank_before = blank
        if self._first_line and (self._keep or not self._in_moves):
            self._bytes += len(line)
            if self._bytes > self._limits.game_bytes:
                raise _too_big(
                    f"{self._where}, game {self._index} (line {self._first_line})",
                    f"it has more than {self._limits.game_bytes / _MB:g} MB",
                )
            self._kept.append(line)

    def _digest(self, line: bytes) -> None:
        if not self._in_comment and line[:1] == b"%":
            return
        if not self._in_moves and line[:1] == b"[":
            self._event_seen = self._event_seen or bool(_EVENT_LINE.match(line))
            return
        moves = self._without_comments(line)
        if not moves.strip(_BLANK):
            return
        self._in_moves = True
        if b"(" in moves or b")" in moves:
            self._depth = max(0, self._depth + moves.count(b"(") - moves.count(b")"))
        if self._depth == 0 and moves.rstrip(_BLANK).endswith(_RESULTS):
            self._ended = True

    def _without_comments(self, line: bytes) -> bytes:
        if self._in_comment:
            _, closed, line = line.partition(b"}")
            if not closed:
                return b""
            self._in_comment = False
        if b"{" in line or b";" in line:
            line = _COMMENT.sub(b" ", line)
            line, opened, _ = line.partition(b"{")
            self._in_comment = bool(opened)
        return line

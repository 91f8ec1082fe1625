"""Writing games in Portable Game Notation, export format (PGN 1994, section 3.2)."""

import os
import re
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

import chess

from kempelen.core.errors import NotationError
from kempelen.game.notation import numbered, san_log
from kempelen.game.pgn import GameScore

_ROSTER = {
    "Event": "?",
    "Site": "?",
    "Date": "????.??.??",
    "Round": "?",
    "White": "?",
    "Black": "?",
    "Result": "*",
}
_TAG_NAME = re.compile(r"[A-Za-z0-9_]+")
_WIDTH = 80  # columns, PGN 1994 section 4.3


def format_pgn(score: GameScore, *, comment: str = "") -> str:
    """The game as PGN text: seven tag roster, other tags, moves in SAN, the result.

    Args:
        score: ``headers`` need not be complete; ``Result``, ``SetUp`` and ``FEN`` are set from the score
            itself, ``PlyCount`` from its moves. Give ``Termination`` among the headers.
        comment: Put before the result, for example the reason of the game's end.

    Raises:
        NotationError: A move is illegal in its turn or a tag's name is none.
    """
    tags = "\n".join(_tag(name, value) for name, value in _tags(score).items())
    tokens = list(numbered(score.start_fen, san_log(score.start_fen, score.moves)))
    if comment:
        # A comment cannot contain the brace that ends it.
        tokens += f"{{ {' '.join(comment.split()).replace('}', ')')} }}".split()
    return f"{tags}\n\n{_wrapped([*tokens, score.result])}\n\n"


def write_pgn(path: str | os.PathLike[str], score: GameScore, *, comment: str = "") -> None:
    """Put the game into a file of its own, replacing what it held.

    At any instant, power cuts included, the file holds the old text or the new one: the text goes to a
    temporary file beside it, is forced to disk, and takes its name.

    Raises:
        NotationError: As for `format_pgn`, or the file cannot be written.
    """
    target = Path(path)
    data = format_pgn(score, comment=comment).encode()
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        _replace(target, data)
    except OSError as error:
        why = error.strerror or str(error)
        raise NotationError(
            f"The game cannot be written to {target}: {why}.",
            hint="Check the directory, its permissions and the disk.",
        ) from error


def _replace(target: Path, data: bytes) -> None:
    handle, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.chmod(0o644)
        temporary.replace(target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    _sync_directory(target.parent)


def _sync_directory(directory: Path) -> None:
    """Force the new name itself to disk."""
    handle = os.open(directory, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _tags(score: GameScore) -> Mapping[str, str]:
    tags = _ROSTER | dict(score.headers) | {"Result": score.result, "PlyCount": str(len(score.moves))}
    for name in ("SetUp", "FEN"):
        tags.pop(name, None)
    if score.start_fen != chess.STARTING_FEN:
        tags |= {"SetUp": "1", "FEN": score.start_fen}
    return tags


def _tag(name: str, value: str) -> str:
    if not _TAG_NAME.fullmatch(name):
        raise NotationError(f"{name!r} is no name of a PGN tag.", hint="Use letters, digits and underscores.")
    plain = "".join(letter if letter.isprintable() else " " for letter in value)
    escaped = plain.replace("\\", "\\\\").replace('"', '\\"')
    return f'[{name} "{escaped}"]'


def _wrapped(tokens: list[str]) -> str:
    return "\n".join(_lines(tokens))


def _lines(tokens: list[str]) -> Iterator[str]:
    line = ""
    for token in tokens:
        if line and len(line) + 1 + len(token) >= _WIDTH:
            yield line
            line = token
        else:
            line = f"{line} {token}".lstrip()
    yield line

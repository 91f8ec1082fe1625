"""Moves named from two photos: one before whose position is known, one after; the camera is held by hand.

Which way round the board lies and whose turn it is are known, as in a game. Two plies are recognised but not
named: two photos tell them too badly from three. Beside it: the legal move whose squares changed their colour
most, with no way of saying "unsure".
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import chess
import cv2
import numpy as np

from kempelen.bench.real_data import Labelled, labelled, labelled_moves
from kempelen.bench.result import Progress
from kempelen.bench.section import Section, counted
from kempelen.core.camera import Frame
from kempelen.core.errors import ConfigError, SensorError
from kempelen.core.geometry import Array
from kempelen.core.senses import Observation, states_of
from kempelen.sensing.board.finder import BoardFinder
from kempelen.sensing.colour.columns import plane, tiles, without_margin
from kempelen.sensing.colour.reader import ColourReader
from kempelen.sensing.moves.parameters import MoveParameters
from kempelen.sensing.moves.reader import MoveReader
from kempelen.sensing.moves.verdicts import Line, Moved, Verdict
from kempelen.sensing.sighting import BoardSighting

_PIXELS = 24  # of a square, for differences of colour
_RIM = 5  # of these that belong to the neighbours as likely as not
_BUDGET = 0.01
"""Doubt that an accepted move may leave. Photos of one game, two or three apart or in reverse, either side to
move, made 189 questions: no single move was accepted wrongly, and a wrong one was never ahead of all else,
strays included, by more than 2.9 nats. The reader's parameters were chosen on these photos too.
"""
_NOT_NAMED: Line = ()

Seen = tuple[Frame, BoardSighting]
Look = tuple[Frame, BoardSighting | None]


@dataclass(frozen=True, eq=False)
class _Pair:
    """Two photos and what was played between them."""

    before: Labelled
    after: Labelled
    board: chess.Board
    moves: Line

    @property
    def name(self) -> str:
        return f"{self.before.path.stem} {self.after.path.stem}"


@dataclass(frozen=True)
class _Answer:
    """To one pair: the line that was accepted, empty when unsure, and what else was said."""

    pair: _Pair
    line: Line
    said: str

    @property
    def right(self) -> bool:
        return self.line == self.pair.moves

    @property
    def wrong(self) -> bool:
        return bool(self.line) and not self.right


def measure_moves(data: Path, seed: int, progress: Progress) -> Section:
    """Every pair of labelled photos: board found by us, board given by its labels, differences of colour.

    Args:
        data: With ``game-photos``, or without.
        seed: Not used: nothing is random.
        progress: Told before each pair.
    """
    del seed
    pairs = list(_pairs(data))
    if not pairs:
        return Section()
    finder = BoardFinder()
    ways: dict[str, list[_Answer]] = {"found": [], "labelled": [], "differences": []}
    for number, pair in enumerate(pairs):
        progress(f"move between {pair.name}", number / len(pairs))
        found = _looks(pair, lambda photo, frame: photo.found(finder, frame))
        ways["found"].append(_answer(pair, found, _read))
        ways["labelled"].append(_answer(pair, _looks(pair, lambda photo, _: photo.sighting()), _read))
        ways["differences"].append(_answer(pair, found, _differences))
    rows = [row for way, answers in ways.items() for row in _rows(way, answers)]
    return Section(_figures(ways), [*rows, *(_told(answer) for answer in ways["found"])])


def _pairs(data: Path) -> Iterator[_Pair]:
    photos = {photo.path.name: photo for photo in labelled(data, "game-photos")}
    for entry in labelled_moves(data):
        try:
            before, after = photos[entry["before"]], photos[entry["after"]]
            moves = tuple(chess.Move.from_uci(uci) for uci in entry["uci"])
            yield _Pair(before, after, _known(before.label["fen"], moves[0]), moves)
        except (KeyError, IndexError, ValueError) as error:
            raise ConfigError(
                f"The move {entry} in the labels of the game photos cannot be read: {error!r}.",
                hint="It needs before, after (both among the photos) and uci, a list of moves.",
            ) from error


def _known(fen: str, first: chess.Move) -> chess.Board:
    """The position, with the right to move; rights to castle wherever king and rook stand at home."""
    board = chess.Board(fen)
    board.turn = bool(board.color_at(first.from_square))
    board.castling_rights = chess.BB_CORNERS
    board.castling_rights = board.clean_castling_rights()
    board.ep_square = None
    return board


def _looks(pair: _Pair, sighted: Callable[[Labelled, Frame], BoardSighting | None]) -> list[Look]:
    """Both photos with their boards."""
    frames = [(photo, photo.frame()) for photo in (pair.before, pair.after)]
    return [(frame, sighted(photo, frame)) for photo, frame in frames]


def _answer(
    pair: _Pair, looks: Sequence[Look], read: Callable[[_Pair, Seen, Seen], tuple[Line, str]]
) -> _Answer:
    seen: list[Seen] = []
    for photo, (frame, sighting) in zip((pair.before, pair.after), looks, strict=True):
        if sighting is None:
            return _Answer(pair, _NOT_NAMED, f"board not found in {photo.path.name}")
        seen.append((frame, sighting))
    try:
        return _Answer(pair, *read(pair, *seen))
    except SensorError as error:
        return _Answer(pair, _NOT_NAMED, str(error))


def _read(pair: _Pair, before: Seen, after: Seen) -> tuple[Line, str]:
    reader = ColourReader()
    reader.learn(*before, states_of(pair.board))
    verdict = _verdict(pair.board, reader.read(*after))
    return (verdict.moves if isinstance(verdict, Moved) else _NOT_NAMED), str(verdict)


def _verdict(board: chess.Board, log_likelihood: Array) -> Verdict:
    parameters = MoveParameters.of_pictures(_BUDGET)
    moves = MoveReader(board, parameters)
    verdict = moves.update(Observation(log_likelihood, 0.0))
    for frame in range(1, parameters.frames):
        verdict = moves.update(Observation(log_likelihood, float(frame)))
    return verdict


def _differences(pair: _Pair, before: Seen, after: Seen) -> tuple[Line, str]:
    """The legal move whose squares stand out most: largest correlation with the squares that it changes."""
    old, new = (cv2.cvtColor(_board(seen) / 255, cv2.COLOR_BGR2LAB) for seen in (before, after))
    off = tiles(new - old)[:, _RIM:-_RIM, _RIM:-_RIM]
    off -= np.median(off.reshape(-1, 3), axis=0)  # exposure and white balance
    change = np.linalg.norm(off, axis=-1).mean(axis=(1, 2))
    best = max(pair.board.legal_moves, key=lambda move: _fit(pair.board, move, change), default=None)
    return ((best,) if best else _NOT_NAMED), ""


def _board(seen: Seen) -> Any:
    return np.ascontiguousarray(without_margin(plane(*seen, _PIXELS)))


def _fit(board: chess.Board, move: chess.Move, change: Array) -> float:
    after = board.copy(stack=False)
    after.push(move)
    touched = states_of(board) != states_of(after)
    return float(np.corrcoef(touched, change)[0, 1])


def _rows(way: str, answers: list[_Answer]) -> Iterator[dict[str, Any]]:
    for plies in sorted({len(answer.pair.moves) for answer in answers}):
        those = [answer for answer in answers if len(answer.pair.moves) == plies]
        right = sum(answer.right for answer in those)
        wrong = sum(answer.wrong for answer in those)
        yield {"data": "real", "moves": way, "plies": plies, **counted(right, len(those)), "wrong": wrong}


def _figures(ways: dict[str, list[_Answer]]) -> dict[str, float]:
    one = {way: [a for a in answers if len(a.pair.moves) == 1] for way, answers in ways.items()}
    more = [a for a in ways["found"] if len(a.pair.moves) > 1]
    return {
        "moves_named": float(sum(a.right for a in one["found"])),
        "moves": float(len(one["found"])),
        "wrong_accepts": float(sum(a.wrong for a in one["found"])),
        "moves_named_labelled_corners": float(sum(a.right for a in one["labelled"])),
        "wrong_accepts_labelled_corners": float(sum(a.wrong for a in one["labelled"])),
        "moves_named_differences": float(sum(a.right for a in one["differences"])),
        "wrong_accepts_differences": float(sum(a.wrong for a in one["differences"])),
        "two_plies_named": float(sum(a.right for a in more)),
        "two_plies": float(len(more)),
        "two_plies_wrong_accepts": float(sum(a.wrong for a in more)),
    }


def _told(answer: _Answer) -> dict[str, Any]:
    played = " ".join(move.uci() for move in answer.pair.moves)
    named = " ".join(move.uci() for move in answer.line) or "unsure"
    return {"data": "real, board found", "pair": answer.pair.name, "played": played, "named": named}

"""Occupancy of real boards from depth, each with a reference learned from the other frames alone."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from kempelen.bench.real_data import Labelled, labelled
from kempelen.bench.result import Progress
from kempelen.bench.section import Section, counted
from kempelen.bench.thesis_rule import thesis_occupied
from kempelen.core.camera import Frame
from kempelen.core.senses import EMPTY, WHITE
from kempelen.sensing.board.finder import BoardFinder
from kempelen.sensing.depth.geometry import depth_of
from kempelen.sensing.depth.reader import DepthReader
from kempelen.sensing.sighting import BoardSighting

_UNREAD = np.full(64, np.nan)


@dataclass(frozen=True, eq=False)
class _Board:
    """One frame with what is known of it; the top of the picture is taken for the last rank."""

    name: str
    frame: Frame
    sighting: BoardSighting | None
    occupied: npt.NDArray[np.bool_]


def measure_depth(folder: Path, seed: int, progress: Progress) -> Section:
    """Leave one frame out, and counting points above 10 mm beside it.

    The board is found by the finder, not taken from the labels, which only say which way round it is.

    Args:
        folder: With ``rgbd``, or without.
        seed: Not used: nothing is random.
        progress: Told before each frame.
    """
    del seed
    finder = BoardFinder()
    boards = [_load(finder, picture) for picture in labelled(folder, "rgbd")]
    if not boards:
        return Section()
    rows = []
    for number in range(len(boards)):
        progress(f"depth of {boards[number].name}", number / len(boards))
        rows.append(_row(boards, number))
    return Section(_figures(rows), rows)


def _load(finder: BoardFinder, picture: Labelled) -> _Board:
    frame = picture.frame()
    occupied = np.array(picture.label["occupancy"], dtype=bool)[::-1].reshape(64)
    return _Board(picture.path.name, frame, picture.found(finder, frame), occupied)


def _row(boards: list[_Board], number: int) -> dict[str, Any]:
    board = boards[number]
    over, counted_wrong = _UNREAD, len(board.occupied)
    if board.sighting is not None:
        reader = _taught([*boards[:number], *boards[number + 1 :]])
        seen = reader.read(board.frame, board.sighting).log_likelihood
        over = seen[:, WHITE] - seen[:, EMPTY]
        counted_wrong = int((thesis_occupied(reader.view, depth_of(board.frame)) != board.occupied).sum())
    right = np.where(board.occupied, over, -over) > 0
    return {
        "depth_of": board.name.removesuffix(".jpg"),
        "data": "real",
        "pieces": int(board.occupied.sum()),
        "wrong": int((~right).sum()),
        "counting_wrong": counted_wrong,
        "least_nats": round(float(np.where(board.occupied, over, -over).min()), 2),
    }


def _taught(others: list[_Board]) -> DepthReader:
    reader = DepthReader()
    for other in others:
        if other.sighting is not None:
            position = np.where(other.occupied, WHITE, EMPTY)
            reader.learn([other.frame], other.sighting, position)
    return reader


def _figures(rows: list[dict[str, Any]]) -> dict[str, float]:
    right = sum(row["wrong"] == 0 for row in rows)
    interval = counted(right, len(rows))
    return {
        "rgbd_boards_right": right,
        "rgbd_boards": len(rows),
        "rgbd_boards_low_%": interval["low_%"],
        "rgbd_squares_wrong": sum(row["wrong"] for row in rows),
        "rgbd_counting_boards_right": sum(row["counting_wrong"] == 0 for row in rows),
        "rgbd_counting_squares_wrong": sum(row["counting_wrong"] for row in rows),
    }

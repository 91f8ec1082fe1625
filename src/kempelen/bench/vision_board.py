"""How often and how fast the board is found, by each method on the same pictures in one run."""

import statistics
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from kempelen.bench.real_data import FOLDERS, Labelled, labelled
from kempelen.bench.result import Progress
from kempelen.bench.section import Section, counted
from kempelen.core.camera import Frame
from kempelen.core.errors import BoardNotFoundError
from kempelen.core.geometry import Array
from kempelen.sensing.board.finder import METHODS, BoardFinder
from kempelen.sensing.sighting import OUTER_CORNERS, BoardSighting

CLOSE = 0.25
"""Squares: a board counts as found when every outer corner is that near to its label."""

_KEYS = {"board-photos": "board_photos", "game-photos": "game_photos", "rgbd": "rgbd"}


@dataclass
class _Tally:
    """Of one method on one folder: boards found and misplaced, seconds of the clock and of the processor."""

    found: int = 0
    wrong: int = 0
    seconds: list[float] = field(default_factory=list)
    worked: list[float] = field(default_factory=list)

    def row(self, folder: str, method: str) -> dict[str, Any]:
        return {
            "find_the_board": folder.replace("-", " "),
            "method": method,
            "data": "real",
            **counted(self.found, len(self.seconds)),
            "wrong": self.wrong,
            "ms_median": round(1000 * statistics.median(self.seconds), 1),
            "ms_p95": round(1000 * float(np.percentile(self.seconds, 95)), 1),
            "cpu_ms": round(1000 * statistics.median(self.worked), 1),
        }


def measure_finding(data: Path, seed: int, progress: Progress) -> Section:
    """All methods on all pictures.

    Args:
        data: Folder of labelled pictures.
        seed: Not used: nothing here is random.
        progress: Told before each picture.
    """
    del seed
    pictures = [picture for folder in FOLDERS for picture in labelled(data, folder)]
    tallies = {method: {folder: _Tally() for folder in FOLDERS} for method in METHODS}
    for number, picture in enumerate(pictures):
        progress(f"finding the board: {picture.path.name}", number / len(pictures))
        frame = picture.frame()
        for method in METHODS:
            _try(BoardFinder(method), frame, picture, tallies[method][picture.folder])
    rows = [
        tallies[method][folder].row(folder, method)
        for folder in FOLDERS
        for method in METHODS
        if tallies[method][folder].seconds
    ]
    return Section(_figures(tallies), rows)


def corner_error(sighting: BoardSighting, corners: Array) -> float:
    """Squares: the largest distance of an outer corner from its label, the best of the turns taken.

    Args:
        sighting: Oriented or not.
        corners: (4, 2) labelled pixels, the top left one first, clockwise.
    """
    # clockwise in the picture is a1, a8, h8, h1 on the board
    clockwise = OUTER_CORNERS[[0, 3, 2, 1]]
    places = sighting.board_points(corners)
    return min(
        float(np.linalg.norm(places - np.roll(clockwise, turn, axis=0), axis=1).max())
        for turn in range(len(clockwise))
    )


def _try(finder: BoardFinder, frame: Frame, picture: Labelled, tally: _Tally) -> None:
    started, worked = time.perf_counter(), time.process_time()
    try:
        sighting = finder.find(frame)
    except BoardNotFoundError:
        sighting = None
    tally.seconds.append(time.perf_counter() - started)
    tally.worked.append(time.process_time() - worked)
    if sighting is None:
        return
    close = corner_error(sighting, picture.corners) <= CLOSE
    tally.found += close
    tally.wrong += not close


def _figures(tallies: dict[str, dict[str, _Tally]]) -> dict[str, float]:
    out: dict[str, float] = {}
    for method, by_folder in tallies.items():
        prefix = "" if method == METHODS[0] else f"{method}_"
        for folder, tally in by_folder.items():
            out[f"{prefix}{_KEYS[folder]}_found"] = tally.found
            out[_KEYS[folder]] = len(tally.seconds)
        seconds = [each for tally in by_folder.values() for each in tally.seconds]
        if seconds:
            out[f"{prefix}locate_ms_median"] = round(1000 * statistics.median(seconds), 1)
            worked = [each for tally in by_folder.values() for each in tally.worked]
            out[f"{prefix}locate_cpu_ms_median"] = round(1000 * statistics.median(worked), 1)
            out[f"{prefix}locate_ms_p95"] = round(1000 * float(np.percentile(seconds, 95)), 1)
    return out

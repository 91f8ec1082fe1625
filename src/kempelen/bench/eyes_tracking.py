"""Accuracy and speed of the tracker on the twin's Kinect v2 with its nominal noise."""

import os
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import chess
import cv2
import numpy as np
import numpy.typing as npt

from kempelen.bench.eyes_stage import Stage, game_positions
from kempelen.bench.result import Progress
from kempelen.bench.section import Section, counted
from kempelen.bench.thesis_rule import thesis_occupied
from kempelen.core.camera import Frame
from kempelen.core.senses import EMPTY, Observation, states_of
from kempelen.sensing.board.finder import BoardFinder
from kempelen.sensing.depth.geometry import depth_of, view_board
from kempelen.sensing.tracker import Tracker, TrackerSettings, Use

_EVERY = 7  # plies between two positions of a game
_LEARN = 8  # frames before the first reading
_SETTLE = 2  # frames: the first shows a change, with the second the hand has just gone
_LOOKS = 2  # at each position
_TIMED = 240
_DISTINCT = 24  # frames that are shown again and again while the clock runs
_NO_GATE = {"gate.area": 40.0, "gate.big_area": 60.0}  # whole positions come and go without a hand
_THESIS = {
    "depth": "7-15",
    "squares": "5-7",
    "hand": "",
    "colour": "",
    "board": "",
    "health": "",
    "whole": "167-250",
}
"""Of the thesis, ms: figure localisation, processing of the result, and a frame at its 4 to 6 frames/s."""


@dataclass
class _Tally:
    """Readings of one way to read."""

    boards: int = 0
    wrong_boards: int = 0
    wrong_squares: int = 0
    wrong_colours: int = 0
    blind: int = 0

    def add(self, wrong: int, colours: int) -> None:
        self.boards += 1
        self.wrong_boards += wrong + colours > 0
        self.wrong_squares += wrong
        self.wrong_colours += colours

    def row(self, way: str) -> dict[str, Any]:
        return {
            "squares_by": way,
            "data": "simulated",
            "of": "boards",
            **counted(self.boards - self.wrong_boards, self.boards),
            "wrong_squares": self.wrong_squares,
            "wrong_colours": self.wrong_colours,
            "unread": self.blind,
        }


def measure_accuracy(seed: int, progress: Progress) -> Section:
    """Positions of the famous games, each read twice by depth, colour and both, and by the thesis's rule.

    Args:
        seed: Of the camera's noise, and of where on its square each piece stands.
        progress: Told now and then.
    """
    ways = [*Use]
    trackers = {use: Tracker(TrackerSettings(use=use, overrides=_NO_GATE)) for use in ways}
    tallies = {use.value: _Tally() for use in ways} | {"thesis": _Tally()}
    positions = list(game_positions(_EVERY))
    with Stage(seed) as stage:
        stage.show(chess.Board())
        for tracker in trackers.values():
            tracker.expect(chess.Board())
        first = stage.shoot()
        view = view_board(first, BoardFinder().find(first, chess.Board()))
        for _ in range(_LEARN):
            frame = stage.shoot()
            for tracker in trackers.values():
                tracker.update(frame)
        for number, board in enumerate(positions):
            progress(f"position {number + 1} of {len(positions)}", number / len(positions))
            stage.show(board)
            _read(stage, trackers, board, tallies)
            thesis = thesis_occupied(view, depth_of(stage.shoot()))
            tallies["thesis"].add(int((thesis != (states_of(board) != EMPTY)).sum()), 0)
    figures: dict[str, float] = {
        "square_errors": tallies["both"].wrong_squares + tallies["both"].wrong_colours,
        "boards_read": tallies["both"].boards - tallies["both"].wrong_boards,
        "boards_shown": tallies["both"].boards,
    }
    return Section(figures, [tally.row(way) for way, tally in tallies.items()])


def _read(stage: Stage, trackers: dict[Use, Tracker], board: chess.Board, tallies: dict[str, _Tally]) -> None:
    """Show frames for the gates to settle, then count two."""
    wanted = states_of(board)
    for look in range(_SETTLE + _LOOKS):
        frame = stage.shoot()
        for use, tracker in trackers.items():
            seen = tracker.update(frame)
            if look < _SETTLE:
                continue
            tally = tallies[use.value]
            if seen.valid:
                tally.add(*_errors(seen, wanted, colour=use.colour))
            else:
                tally.blind += 1


def _errors(seen: Observation, wanted: npt.NDArray[np.int64], *, colour: bool) -> tuple[int, int]:
    """Squares wrongly occupied or empty, pieces of the wrong colour."""
    occupied = wanted != EMPTY
    over = seen.log_likelihood[:, 1:].max(axis=1) - seen.log_likelihood[:, EMPTY]
    wrong = (over > 0) != occupied
    painted = seen.log_likelihood.argmax(axis=1)
    colours = occupied & ~wrong & (painted != wanted) if colour else np.zeros(64, dtype=bool)
    return int(wrong.sum()), int(colours.sum())


def measure_speed(seed: int, progress: Progress) -> Section:
    """The whole pipeline on one core: a 1080p colour picture and depth in, an observation out.

    Args:
        seed: Of the camera's noise.
        progress: Told before each way to read.
    """
    board = chess.Board()
    with Stage(seed) as stage:
        stage.show(board)
        frames = [stage.shoot() for _ in range(_DISTINCT)]
    rows: list[dict[str, Any]] = []
    figures: dict[str, float] = {}
    with one_core():
        for number, use in enumerate(Use):
            progress(f"speed of {use.value}", number / len(Use))
            whole, cpu, stages = _timed(frames, board, use)
            prefix = "track" if use is Use.BOTH else f"{use.value}_track"
            figures[f"{prefix}_fps"] = round(1000 / float(np.mean(whole)), 1)
            figures[f"{prefix}_cpu_ms"] = round(float(np.mean(cpu)), 2)
            figures[f"{prefix}_cpu_ms_p95"] = round(float(np.percentile(cpu, 95)), 2)
            figures[f"{prefix}_ms_p95"] = round(float(np.percentile(whole, 95)), 2)
            rows += [_stage_row(use, name, times) for name, times in {**stages, "whole": whole}.items()]
    return Section(figures, rows)


def _timed(
    frames: Sequence[Frame], board: chess.Board, use: Use
) -> tuple[list[float], list[float], dict[str, list[float]]]:
    """Of each frame, ms: by the clock, of the processor, and of each of its stages; after learning."""
    tracker = Tracker(TrackerSettings(use=use))
    tracker.expect(board)
    whole: list[float] = []
    cpu: list[float] = []  # what other programs on the core do not disturb
    stages: dict[str, list[float]] = defaultdict(list)
    for number in range(_LEARN + _TIMED):
        frame = replace(frames[number % len(frames)], sequence=number, time=number / 30, depth_time=None)
        start, busy = time.perf_counter(), time.thread_time()
        tracker.update(frame)
        passed, busy = 1000 * (time.perf_counter() - start), 1000 * (time.thread_time() - busy)
        view = tracker.view()
        if number < _LEARN or view is None:
            continue
        whole.append(passed)
        cpu.append(busy)
        for name, spent in view.stages.items():
            stages[name].append(spent)
    return whole, cpu, stages


def _stage_row(use: Use, name: str, times: Sequence[float]) -> dict[str, Any]:
    return {
        "stage": f"{use.value}: {name}",
        "data": "simulated",
        "n": len(times),
        "ms_mean": round(float(np.mean(times)), 2),
        "ms_p50": round(float(np.median(times)), 2),
        "ms_p95": round(float(np.percentile(times, 95)), 2),
        "thesis_ms": _THESIS.get(name, ""),
    }


@contextmanager
def one_core() -> Iterator[None]:
    """This process on one core and OpenCV in one thread, as far as the system lets it."""
    threads = cv2.getNumThreads()
    cores = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else None
    cv2.setNumThreads(1)
    if cores:
        os.sched_setaffinity(0, {max(cores)})
    try:
        yield
    finally:
        cv2.setNumThreads(threads)
        if cores:
            os.sched_setaffinity(0, cores)

"""Error of occupancy against each kind of depth noise over its range, the thesis's rule beside ours.

One number is changed at a time, the others stay nominal. For each value the reader learns from a few frames
of the start position, as in a game, and then reads positions of the famous games one frame at a time.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import chess
import numpy as np

from kempelen.bench.eyes_stage import Stage, game_positions
from kempelen.bench.result import Progress
from kempelen.bench.section import Section
from kempelen.bench.svg_plot import Chart, draw_charts
from kempelen.bench.thesis_rule import thesis_occupied
from kempelen.core.camera import Frame
from kempelen.core.errors import ConfigError
from kempelen.core.senses import EMPTY, WHITE, states_of
from kempelen.sensing.board.finder import BoardFinder
from kempelen.sensing.depth.geometry import depth_of
from kempelen.sensing.depth.reader import DepthReader
from kempelen.sensing.sighting import BoardSighting
from kempelen.twin.cameras.noise import NOMINAL, Noise

PLOT = Path("eyes-sweep.svg")
"""Written into the working directory."""

_SWEPT: Mapping[str, tuple[str, tuple[float, ...]]] = {
    "axial": ("times the nominal spread", (0, 0.5, 1, 2, 3, 4)),
    "lateral": ("mm", (0, 0.8, 1.6, 3.2, 5)),
    "flying": ("off, on", (0, 1)),
    "multipath": ("mm", (0, 2.5, 5, 7.5, 10)),
    "dark_offset": ("mm", (0, 3, 6, 9, 12)),
    "dark_spread": ("off, on", (0, 1)),
    "dropout": ("share of glossy black", (0, 0.05, 0.15, 0.3, 0.5)),
    "offset": ("mm", (-18, -9, 0, 9, 18)),
    "wiggling": ("times -15 to +7 mm", (0, 0.5, 1, 1.5, 2)),
}
_SWITCHES = {"flying", "dark_spread"}
_LEARN = 4
_POSITIONS = 6
_LOOKS = 2
_APART = 29  # plies between two positions


@dataclass(frozen=True, slots=True)
class _Point:
    """Errors at one setting, per cent of the squares."""

    value: float
    ours: float
    thesis: float


def measure_sweep(seed: int, progress: Progress, plot: Path = PLOT) -> Section:
    """Sweep, and draw it.

    Args:
        seed: Of the noise.
        progress: Told before each setting.
        plot: SVG file to write.

    Raises:
        ConfigError: it cannot be written.
    """
    positions = list(game_positions(_APART))[:_POSITIONS]
    total = sum(len(values) for _, values in _SWEPT.values())
    points: dict[str, list[_Point]] = {name: [] for name in _SWEPT}
    with Stage(seed) as stage:
        sighting = _sighting(stage)
        done = 0
        for name, (_, values) in _SWEPT.items():
            for value in values:
                progress(f"{name} = {value:g}", done / total)
                noise = NOMINAL.model_copy(update={name: bool(value) if name in _SWITCHES else value})
                points[name].append(_measure(stage, sighting, positions, noise, value))
                done += 1
    _write(plot, _drawing(points))
    rows = [_row(name, point) for name, line in points.items() for point in line]
    every = [point for line in points.values() for point in line]
    figures = {
        "sweep_settings": float(total),
        "sweep_worst_%": max(point.ours for point in every),
        "sweep_thesis_worst_%": max(point.thesis for point in every),
    }
    return Section(figures, rows, [plot])


def _write(plot: Path, drawing: str) -> None:
    try:
        plot.write_text(drawing, encoding="utf-8")
    except OSError as error:
        raise ConfigError(
            f"The drawing of the sweep cannot be written to {plot.resolve()}: {error.strerror or error}.",
            hint="Run the bench in a directory that you may write to.",
        ) from error


def _sighting(stage: Stage) -> BoardSighting:
    stage.show(chess.Board())
    return BoardFinder().find(stage.shoot(), chess.Board())


def _measure(
    stage: Stage, sighting: BoardSighting, positions: list[chess.Board], noise: Noise, value: float
) -> _Point:
    reader = DepthReader()
    stage.show(chess.Board())
    reader.learn([stage.shoot(noise) for _ in range(_LEARN)], sighting, states_of(chess.Board()))
    ours, thesis = [], []
    for board in positions:
        stage.show(board)
        for _ in range(_LOOKS):
            wrong, counted = _errors(reader, stage.shoot(noise), board)
            ours.append(wrong)
            thesis.append(counted)
    return _Point(value, 100 * float(np.mean(ours)), 100 * float(np.mean(thesis)))


def _errors(reader: DepthReader, frame: Frame, board: chess.Board) -> tuple[float, float]:
    """Shares of the squares that are read wrongly, by us and by the thesis's rule."""
    occupied = states_of(board) != EMPTY
    seen = reader.read(frame).log_likelihood
    counted = thesis_occupied(reader.view, depth_of(frame))
    ours = (seen[:, WHITE] > seen[:, EMPTY]) != occupied
    return float(ours.mean()), float((counted != occupied).mean())


def _row(name: str, point: _Point) -> dict[str, Any]:
    return {
        "noise": name,
        "data": "simulated",
        "value": point.value,
        "wrong_%": round(point.ours, 3),
        "thesis_wrong_%": round(point.thesis, 2),
    }


def _drawing(points: Mapping[str, list[_Point]]) -> str:
    charts = [
        Chart(
            name.replace("_", " "),
            _SWEPT[name][0],
            [point.value for point in line],
            {"ours": [point.ours for point in line], "thesis's rule": [point.thesis for point in line]},
        )
        for name, line in points.items()
    ]
    return draw_charts(charts, "Occupancy by depth: simulated Kinect v2", "squares read wrongly, %")

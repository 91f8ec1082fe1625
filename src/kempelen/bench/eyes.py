"""`kempelen bench eyes`: the eyes over the simulated table, with the noise of a Kinect v2.

How fast they are, how often they read a position wrongly, what each kind of noise does to them, and whole
games of a scripted person, read by nothing but the camera. All of it is simulated; real pictures are measured
by ``kempelen bench vision``.
"""

from pathlib import Path

from kempelen.bench.eyes_games import GAMES, played_games
from kempelen.bench.eyes_sweep import measure_sweep
from kempelen.bench.eyes_tracking import measure_accuracy, measure_speed
from kempelen.bench.result import BenchResult, Progress, part_of
from kempelen.bench.section import Section

_SHARES = {measure_speed: 0.03, measure_accuracy: 0.07, measure_sweep: 0.15}
"""Parts before the games, and their share of the time."""


def run(
    *, seed: int, pgn: Path | None, data: Path | None, progress: Progress, games: int = GAMES
) -> BenchResult:
    """Measure speed, accuracy and the sweep, then play the games.

    Args:
        seed: Of everything random.
        pgn: Not used.
        data: Not used.
        progress: Told before each game.
        games: How many to play.
    """
    del pgn, data
    total, begun = Section(), 0.0
    for part, share in _SHARES.items():
        total += part(seed, part_of(progress, begun, share))
        begun += share
    total += played_games(seed, games, part_of(progress, begun, 1 - begun))
    return BenchResult("eyes", total.figures, total.rows, total.files)

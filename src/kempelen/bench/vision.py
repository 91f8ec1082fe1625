"""`kempelen bench vision`: the eyes on labelled pictures of real boards (``--data``).

Each part of the eyes has its own module ``vision_*``; here they are run one after the other. Real pictures
and simulated ones never share a table.
"""

from collections.abc import Callable
from pathlib import Path

from kempelen.bench.real_data import data_folder
from kempelen.bench.result import BenchResult, Progress, part_of
from kempelen.bench.section import Section
from kempelen.bench.vision_board import measure_finding
from kempelen.bench.vision_depth import measure_depth
from kempelen.bench.vision_kinds import measure_kinds
from kempelen.bench.vision_moves import measure_moves

PARTS: tuple[Callable[[Path, int, Progress], Section], ...] = (
    measure_finding,
    measure_depth,
    measure_moves,
    measure_kinds,
)
"""Called with the folder, the seed and the progress of the part, 0 to 1."""


def run(*, seed: int, pgn: Path | None, data: Path | None, progress: Progress) -> BenchResult:
    """Measure every part.

    Args:
        seed: Of everything random.
        pgn: Not used.
        data: Folder with ``board-photos``, ``game-photos``, ``rgbd``, any of them missing; by default that in
            the environment variable ``KEMPELEN_REAL_DATA``, else ``../shared/real``.
        progress: Told before each picture.

    Raises:
        ConfigError: there are no labelled pictures.
    """
    del pgn
    folder = data_folder(data)
    total, share = Section(), 1 / len(PARTS)
    for number, part in enumerate(PARTS):
        total += part(folder, seed, part_of(progress, number * share, share))
    return BenchResult("vision", total.figures, total.rows)

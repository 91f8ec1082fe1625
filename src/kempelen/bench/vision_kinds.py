"""How well a position without a history is read: which man stands on which square.

Real photos count only where the weights have not been trained on that very file (known by its SHA-256, so
in any folder and under any name). Drawn pictures are the twin's studio's: each shows a set and a board that
the weights have not seen, drawn by the generator of a hundred of the pictures that they have. In both the
board is where the labels say: finding it is measured by itself.
"""

import statistics
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from kempelen.bench.result import Progress, part_of
from kempelen.bench.section import Section, counted
from kempelen.bench.sets.pictures import Truth
from kempelen.bench.sets.samples import Labels, game_photos, studio_pictures
from kempelen.core.errors import TwinError
from kempelen.sensing.kinds.classifier import PieceClassifier, labels_of
from kempelen.sensing.moves.placement import placement

STUDIO_PICTURES = 24


@dataclass
class Tally:
    """Of one way to read on one collection of pictures."""

    boards: int = 0
    boards_right: int = 0
    squares_right: int = 0
    men: int = 0
    men_right: int = 0
    seconds: list[float] = field(default_factory=list)

    def add(self, read: Labels, labels: Labels) -> None:
        """One board: (64,) indices into the classifier's classes, read and true."""
        right = read == labels
        self.boards += 1
        self.boards_right += bool(right.all())
        self.squares_right += int(right.sum())
        self.men += int((labels > 0).sum())
        self.men_right += int(right[labels > 0].sum())

    def rows(self, data: str, pictures: str, way: str) -> Iterator[dict[str, Any]]:
        """Squares, men and boards."""
        counts = {
            "squares": (self.squares_right, 64 * self.boards),
            "men": (self.men_right, self.men),
            "boards": (self.boards_right, self.boards),
        }
        for what, (right, n) in counts.items():
            named = {"read_without_history": pictures, "by": way, "of": what, "data": data}
            yield {**named, **counted(right, n)}

    def figures(self, prefix: str) -> dict[str, float]:
        """As `kempelen bench vision` names them."""
        return {
            f"{prefix}squares_right": self.squares_right,
            f"{prefix}squares": 64 * self.boards,
            f"{prefix}boards_right": self.boards_right,
            f"{prefix}boards": self.boards,
        }

    def ms_median(self) -> float:
        """Of reading a board, crops and network."""
        return round(1000 * statistics.median(self.seconds), 1)


def measure_kinds(data: Path, seed: int, progress: Progress) -> Section:
    """Held-out photos of games, then drawn pictures.

    Args:
        data: Folder of labelled pictures.
        seed: Of the drawn pictures.
        progress: Told before each picture.
    """
    classifier = PieceClassifier()
    seen = set(classifier.notes.photos.values())
    photos = [photo for photo in game_photos(data) if photo.source.digest not in seen]
    truths = (photo.truth() for photo in photos)
    real = _measured(classifier, _told(truths, len(photos), "game photos", part_of(progress, 0.0, 0.5)))
    out = _section("real", "game photos not trained on", "kinds_", real)
    try:
        drawn = studio_pictures(seed, STUDIO_PICTURES)
        simulated = _measured(
            classifier, _told(drawn, STUDIO_PICTURES, "drawn pictures", part_of(progress, 0.5, 0.5))
        )
    except TwinError:
        return out  # no pictures can be drawn on this machine
    return out + _section("simulated", "studio's sets", "twin_sets_", simulated)


def _told(truths: Iterable[Truth], count: int, what: str, progress: Progress) -> Iterator[Truth]:
    """Each picture, after its number was told."""
    for number, truth in enumerate(truths):
        progress(f"reading positions: {what} {number + 1} of {count}", number / count)
        yield truth


def _measured(classifier: PieceClassifier, truths: Iterable[Truth]) -> tuple[Tally, Tally]:
    """Each square by itself, and the likeliest placement that chess allows."""
    alone, together = Tally(), Tally()
    for truth in truths:
        started = time.perf_counter()
        likely = classifier.read(truth.picture, truth.sighting)
        alone.seconds.append(time.perf_counter() - started)
        labels = labels_of(truth.board)
        alone.add(likely.argmax(axis=1), labels)
        together.add(labels_of(placement(likely).board), labels)
    return alone, together


def _section(data: str, pictures: str, prefix: str, tallies: tuple[Tally, Tally]) -> Section:
    alone, together = tallies
    if not alone.boards:
        return Section(together.figures(prefix))
    rows = [*alone.rows(data, pictures, "each square"), *together.rows(data, pictures, "rules of chess")]
    return Section({**together.figures(prefix), f"{prefix}ms_median": alone.ms_median()}, rows)

"""What `kempelen bench vision` counts of the piece classifier."""

import hashlib
import json
import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from kempelen.bench import vision_kinds
from kempelen.bench.sets.pictures import Truth
from kempelen.bench.sets.samples import game_photos
from kempelen.bench.vision_kinds import Tally, measure_kinds
from kempelen.core.errors import TwinError
from kempelen.sensing.kinds.classifier import PieceClassifier, labels_of

REAL = Path(os.environ.get("KEMPELEN_REAL_DATA", Path(__file__).parents[4] / ".." / "shared" / "real"))


def nothing_drawn(seed: int, count: int) -> list[Truth]:
    raise TwinError(f"{count} pictures of seed {seed} cannot be drawn")


@pytest.fixture
def photos(tmp_path: Path) -> Path:
    """Two pictures of nothing with labels, a king apart."""
    folder = tmp_path / "game-photos"
    folder.mkdir()
    corners = [[50.0, 60.0], [250.0, 60.0], [270.0, 280.0], [30.0, 280.0]]
    rows: list[dict[str, object]] = []
    for name, fen in (("a.png", "8/8/8/8/8/8/8/K6k w - - 0 1"), ("b.png", "8/8/8/8/8/8/K7/7k b - - 0 1")):
        picture = np.random.default_rng(len(rows)).integers(0, 256, (320, 320, 3), dtype=np.uint8)
        cv2.imwrite(str(folder / name), picture)
        rows.append({"image": name, "corners_px": corners, "fen": fen})
    (folder / "labels.json").write_text(json.dumps({"photos": rows, "moves": []}))
    return tmp_path


def test_a_tally_counts_squares_men_and_boards() -> None:
    tally, labels = Tally(), np.array([6, 12] + [0] * 62)
    wrong = labels.copy()
    wrong[1] = 11
    tally.add(labels, labels)
    tally.add(wrong, labels)
    assert tally.figures("kinds_") == {
        "kinds_squares_right": 127,
        "kinds_squares": 128,
        "kinds_boards_right": 1,
        "kinds_boards": 2,
    }
    assert [(row["right"], row["n"]) for row in tally.rows("real", "photos", "each")] == [
        (127, 128),
        (3, 4),
        (1, 2),
    ]


def test_photos_that_were_trained_on_are_not_scored(photos: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(vision_kinds, "studio_pictures", nothing_drawn)
    told: list[str] = []
    assert measure_kinds(photos, 0, lambda what, _share: told.append(what)).figures["kinds_boards"] == 2
    assert len(told) == 2
    digest = hashlib.sha256((photos / "game-photos" / "a.png").read_bytes()).hexdigest()
    monkeypatch.setattr(vision_kinds, "PieceClassifier", lambda: Seen(digest))
    assert measure_kinds(photos, 0, lambda _what, _share: None).figures["kinds_boards"] == 1


class Seen(PieceClassifier):
    """Trained on one photo more."""

    def __init__(self, digest: str) -> None:
        super().__init__()
        photos = {**self.notes.photos, "under another name.jpg": digest}
        self.notes = type(self.notes)(self.notes.temperature, photos, self.notes.layer)


def test_without_photos_there_are_none_right(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(vision_kinds, "studio_pictures", nothing_drawn)
    section = measure_kinds(tmp_path, 0, lambda _what, _share: None)
    assert section.figures["kinds_squares"] == 0
    assert not section.rows


@pytest.mark.parametrize("group", ["trained_on", "other_sets"])
def test_labels_of_our_own_are_whole_boards(group: str) -> None:
    told = json.loads((Path(__file__).parents[4] / "bench" / "piece_labels.json").read_text())
    for digest, rows in told[group].items():
        assert len(digest) == 64
        assert [len(rank) for rank in rows.split("/")] == [8] * 8
        assert set(rows) <= set("/?.PNBRQKpnbrqk")
    assert not set(told["trained_on"]) & set(told["other_sets"])


def test_photos_that_differ_little_are_of_one_game(photos: Path) -> None:
    assert [photo.game for photo in game_photos(photos)] == [1, 1]


@pytest.mark.skipif(not (REAL / "game-photos").is_dir(), reason="no real photos here: set KEMPELEN_REAL_DATA")
def test_men_of_a_game_that_was_not_trained_on_are_recognised() -> None:
    classifier = PieceClassifier()
    seen = set(classifier.notes.photos.values())
    unseen = [photo for photo in game_photos(REAL) if photo.source.digest not in seen][:3]
    if not unseen:
        pytest.skip("the weights have seen all of these photos")
    right = []
    for photo in unseen:
        truth = photo.truth()
        labels = labels_of(truth.board)
        read = classifier.read(truth.picture, truth.sighting).argmax(axis=1)
        right.append(read == labels)
    assert np.mean(right) > 0.85

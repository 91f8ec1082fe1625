import json
import os
from pathlib import Path

import pytest

from kempelen.bench.real_data import VARIABLE
from kempelen.bench.vision_moves import measure_moves
from kempelen.core.errors import ConfigError

PHOTOS = Path(os.environ.get(VARIABLE, Path(__file__).parents[5] / "shared" / "real")) / "game-photos"


def quiet(what: str, share: float) -> None:
    del what, share


def some(folder: Path, pairs: slice) -> Path:
    """A folder with those pairs of the photos."""
    labels = json.loads((PHOTOS / "labels.json").read_text())
    moves = [move for move in labels["moves"] if len(move["uci"]) == 1][pairs]
    used = {name for move in moves for name in (move["before"], move["after"])}
    photos = [
        {**photo, "image": str(PHOTOS / photo["image"])}
        for photo in labels["photos"]
        if photo["image"] in used
    ]
    return written(folder, {"photos": photos, "moves": [_here(move) for move in moves]})


def _here(move: dict[str, object]) -> dict[str, object]:
    return {**move, "before": Path(str(move["before"])).name, "after": Path(str(move["after"])).name}


def written(folder: Path, labels: object) -> Path:
    (folder / "game-photos").mkdir(parents=True)
    (folder / "game-photos" / "labels.json").write_text(json.dumps(labels))
    return folder


@pytest.mark.skipif(not PHOTOS.is_dir(), reason=f"no game photos in {PHOTOS}")
def test_moves_are_named_between_photos_of_a_real_game(tmp_path: Path) -> None:
    section = measure_moves(some(tmp_path / "photos", slice(0, 3)), 0, quiet)

    assert section.figures["moves"] == 3
    assert section.figures["moves_named"] == 3
    assert section.figures["wrong_accepts"] == 0


def test_nothing_is_said_without_pairs(tmp_path: Path) -> None:
    assert measure_moves(written(tmp_path / "none", {"photos": []}), 0, quiet).rows == []


@pytest.mark.parametrize("move", [{"before": "a.jpg", "after": "b.jpg", "uci": ["e2e4"]}, {"uci": []}])
def test_labels_that_name_no_photos_are_refused(tmp_path: Path, move: dict[str, object]) -> None:
    folder = written(tmp_path / "odd", {"photos": [], "moves": [move]})

    with pytest.raises(ConfigError, match="in the labels of the game photos cannot be read"):
        measure_moves(folder, 0, quiet)

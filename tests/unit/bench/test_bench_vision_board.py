import json
import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from tests.unit.sensing.board.chequer import drawn, view

from kempelen.bench.real_data import data_folder, labelled
from kempelen.bench.section import counted
from kempelen.bench.vision_board import corner_error, measure_finding
from kempelen.bench.wilson import wilson
from kempelen.core.errors import BoardNotFoundError, ConfigError
from kempelen.sensing.board.finder import BoardFinder

REAL = Path(os.environ.get("KEMPELEN_REAL_DATA", Path(__file__).parents[4] / "shared" / "real"))
HARD = ("16.jpg", "7.jpg", "cc6.jpg", "IMG_4754.jpg", "IMG_4781.jpg", "03_03_2022_17_47_08.jpg")
"""A round table, a board cut by the frame, a hinge seen from the side, a curled mat, shadows, a full set."""


@pytest.mark.parametrize(
    ("successes", "n", "low", "high"), [(0, 10, 0.0, 0.2775), (5, 10, 0.2366, 0.7634), (30, 30, 0.8865, 1.0)]
)
def test_wilson(successes: int, n: int, low: float, high: float) -> None:
    assert wilson(successes, n) == pytest.approx((low, high), abs=1e-4)


def test_wilson_of_nothing() -> None:
    assert wilson(0, 0) == (0.0, 1.0)
    with pytest.raises(ValueError, match="3 of 2"):
        wilson(3, 2)
    assert counted(30, 30)["low_%"] == pytest.approx(88.6)


def labelled_folder(tmp_path: Path) -> Path:
    """One board photo, with its label; the other folders missing."""
    folder = tmp_path / "board-photos"
    folder.mkdir()
    truth, _ = view(turn=0.2)
    assert cv2.imwrite(str(folder / "one.png"), drawn(truth))
    ends = np.array([[0, 8, 1], [8, 8, 1], [8, 0, 1], [0, 0, 1]]) @ truth.T
    label = {"image": "one.png", "corners_px": (ends[:, :2] / ends[:, 2:]).tolist()}
    (folder / "labels.json").write_text(json.dumps([label]), encoding="utf-8")
    return tmp_path


def test_finding_is_counted_by_method(tmp_path: Path) -> None:
    section = measure_finding(labelled_folder(tmp_path), 0, lambda _what, _share: None)

    assert section.figures["board_photos_found"] == 1
    assert section.figures["board_photos"] == 1
    assert section.figures["game_photos"] == 0
    assert section.figures["opencv_board_photos_found"] == 1
    assert section.figures["locate_ms_median"] > 0
    assert [row["method"] for row in section.rows] == ["lattice", "thesis", "opencv"]


def test_a_folder_without_labels_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no labelled pictures"):
        data_folder(tmp_path)


def test_damaged_labels_and_pictures_are_refused(tmp_path: Path) -> None:
    data = labelled_folder(tmp_path)
    (data / "board-photos" / "one.png").write_bytes(b"not a picture")
    with pytest.raises(ConfigError, match=r"one\.png"):
        labelled(data, "board-photos")[0].frame()
    (data / "board-photos" / "labels.json").write_text("{", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"labels\.json"):
        labelled(data, "board-photos")


@pytest.mark.skipif(not REAL.is_dir(), reason="no real pictures here: set KEMPELEN_REAL_DATA")
@pytest.mark.parametrize("name", HARD)
def test_hard_real_boards(name: str) -> None:
    every = [each for kind in ("board-photos", "game-photos", "rgbd") for each in labelled(REAL, kind)]
    picture = next((each for each in every if each.path.name == name), None)
    if picture is None:
        pytest.skip(f"no {name} among these pictures")

    sighting = BoardFinder().find(picture.frame())

    assert corner_error(sighting, picture.corners) <= 0.25


@pytest.mark.skipif(not REAL.is_dir(), reason="no real pictures here: set KEMPELEN_REAL_DATA")
def test_a_real_board_with_its_last_rows_out_of_view_is_refused() -> None:
    for each in labelled(REAL, "game-photos")[::10]:
        picture, corners = each.picture(), each.corners
        cut = int(corners[2:, 1].min() - 0.2 * np.ptp(corners[:, 1]))
        with pytest.raises(BoardNotFoundError, match="cut off at the bottom|Only"):
            BoardFinder().find_in_picture(np.ascontiguousarray(picture[:cut]))

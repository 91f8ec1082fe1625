import os
from pathlib import Path

import pytest

from kempelen.bench.vision_depth import measure_depth

DATA = Path(os.environ.get("KEMPELEN_REAL_DATA", Path(__file__).parents[5] / "shared" / "real"))

pytestmark = pytest.mark.skipif(
    not (DATA / "rgbd" / "labels.json").is_file(), reason="needs the labelled depth pictures"
)


def test_every_board_is_right_with_a_reference_from_the_other_frames() -> None:
    section = measure_depth(DATA, 0, lambda _what, _share: None)
    assert section.figures["rgbd_squares_wrong"] == 0
    assert section.figures["rgbd_boards_right"] == section.figures["rgbd_boards"] == len(section.rows)
    assert section.figures["rgbd_counting_boards_right"] < section.figures["rgbd_boards"]


def test_a_folder_without_depth_has_no_rows(tmp_path: Path) -> None:
    assert not measure_depth(tmp_path, 0, lambda _what, _share: None).rows

"""Where White sat last time."""

from pathlib import Path

import numpy as np
import pytest

from kempelen.app.camera_side import KnownSides, side_of

SQUARE = np.array([[0.0, 8.0], [8.0, 8.0], [8.0, 0.0], [0.0, 0.0]])  # a1, h1, h8, a8 with White at the bottom


@pytest.mark.parametrize(("turns", "side"), list(enumerate(["bottom", "right", "top", "left"])))
def test_the_side_is_that_of_the_first_rank(turns: int, side: str) -> None:
    angle = -turns * np.pi / 2 + 0.3
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    assert side_of((SQUARE - 4) @ turn.T) == side


def test_each_camera_has_its_own(tmp_path: Path) -> None:
    sides = KnownSides(tmp_path / "sides.json")
    assert sides.get("uvc:0") == ""
    sides.put("uvc:0", "top")
    sides.put("twin", "bottom")
    assert (sides.get("uvc:0"), sides.get("twin")) == ("top", "bottom")


@pytest.mark.parametrize("text", ["", "[]", '{"uvc:0": "inside"}', '{"uvc:0": 3}'])
def test_what_cannot_be_read_is_forgotten(tmp_path: Path, text: str) -> None:
    file = tmp_path / "sides.json"
    file.write_text(text)
    assert KnownSides(file).get("uvc:0") == ""

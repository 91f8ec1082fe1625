import cv2
import numpy as np
import pytest
from tests.unit.sensing.board.chequer import TABLE, drawn, view

from kempelen.core.camera import Frame, Picture
from kempelen.core.errors import BoardNotFoundError
from kempelen.sensing.board.finder import BoardFinder


def reason(picture: Picture) -> str:
    with pytest.raises(BoardNotFoundError) as caught:
        BoardFinder().find_in_picture(picture)
    return str(caught.value)


def flat(level: int) -> Picture:
    return np.full((480, 640, 3), level, dtype=np.uint8)


def test_darkness() -> None:
    board = drawn(view()[0])

    assert "dark" in reason((board * 0.04).astype(np.uint8))
    assert "dark" in reason(flat(0))


def test_a_dim_picture_still_shows_the_board() -> None:
    board = drawn(view()[0], noise=0.0)

    assert BoardFinder().find_in_picture((board * 0.15).astype(np.uint8)).confidence > 0.99


def test_a_covered_lens() -> None:
    y, x = np.mgrid[0:480, 0:640]
    finger = np.stack([60 + x / 300, 60 + y / 300, 90 + x / 300], axis=-1)

    assert "Uncover the lens" in reason(finger.astype(np.uint8))


def test_noise() -> None:
    noise = np.random.default_rng(0).integers(0, 256, (480, 640, 3)).astype(np.uint8)

    assert "noise" in reason(noise)


def test_no_board() -> None:
    blobs = np.full((480, 640, 3), TABLE, dtype=np.uint8)
    rng = np.random.default_rng(1)
    for _ in range(60):
        x, y, radius = rng.integers((0, 0, 5), (640, 480, 60))
        cv2.circle(
            blobs, (int(x), int(y)), int(radius), [int(level) for level in rng.integers(0, 255, 3)], -1
        )

    assert "no board" in reason(blobs)


def test_two_boards() -> None:
    board = drawn(view(turn=0.2)[0])
    other = drawn(view(turn=0.9)[0], seed=1)

    assert "two boards" in reason(np.hstack([board, other]))


@pytest.mark.parametrize("edge", ["left", "right", "top", "bottom"])
def test_a_board_half_out_of_view(edge: str) -> None:
    truth, _ = view(turn=0.05, tilt=0.2)
    left, top = np.floor(drawn_bounds(truth)[0]).astype(int)
    right, bottom = np.ceil(drawn_bounds(truth)[1]).astype(int)
    across, down = (right - left) // 4, (bottom - top) // 4
    board = drawn(truth)
    part = {
        "left": board[:, left + across :],
        "right": board[:, : right - across],
        "top": board[top + down :],
        "bottom": board[: bottom - down],
    }[edge]

    assert f"cut off at the {edge}" in reason(np.ascontiguousarray(part))


def drawn_bounds(image_from_board: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    ends = np.array([[0, 0, 1], [8, 0, 1], [8, 8, 1], [0, 8, 1]]) @ image_from_board.T
    points = ends[:, :2] / ends[:, 2:]
    return points.min(axis=0), points.max(axis=0)


@pytest.mark.parametrize(("squares", "words"), [((8, 7), "Only 7"), ((6, 8), "Only 6"), ((7, 7), "Only 7")])
def test_fewer_rows_than_a_board_has(squares: tuple[int, int], words: str) -> None:
    assert words in reason(drawn(view(distance=800)[0], squares=squares))


@pytest.mark.parametrize("squares", [(9, 8), (9, 9), (10, 10), (12, 12)])
def test_more_rows_than_a_board_has(squares: tuple[int, int]) -> None:
    assert "goes on beyond" in reason(drawn(view(distance=1000, tilt=0.3)[0], squares=squares))


def test_a_board_seen_from_the_side() -> None:
    assert "too small" in reason(drawn(view(distance=1000, tilt=1.36)[0], noise=0.5))


def test_a_hidden_row_is_never_guessed() -> None:
    """Seven rows and a blank one: the blank one may be either end's."""
    board = drawn(view(turn=0.0, tilt=0.0)[0])
    low, high = drawn_bounds(view(turn=0.0, tilt=0.0)[0])
    side = (high - low)[1] / 8
    board[: int(low[1] + side), :] = TABLE

    assert "Only 7 rows" in reason(board)


def test_frames_without_a_usable_picture() -> None:
    finder = BoardFinder()
    for colour in (None, np.zeros((480, 640), np.uint8), np.zeros((480, 640, 3), np.float32)):
        with pytest.raises(BoardNotFoundError, match="height, width, 3"):
            finder.find(Frame(0, 0.0, colour))  # type: ignore[arg-type]
    with pytest.raises(BoardNotFoundError, match="at least 64"):
        finder.find(Frame(0, 0.0, np.zeros((20, 30, 3), np.uint8)))

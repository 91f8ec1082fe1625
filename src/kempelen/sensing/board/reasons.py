"""Why there is no board in a picture, in words for the person at the table."""

import cv2
import numpy as np

from kempelen.core.camera import Picture
from kempelen.core.errors import BoardNotFoundError
from kempelen.core.geometry import Array
from kempelen.sensing.board.corners import Grey
from kempelen.sensing.board.placement import GRID, ROWS, Placement
from kempelen.sensing.sighting import OUTER_CORNERS, moved

_DARK = 24.0  # grey levels of the brightest hundredth: below it nothing is lit
_FLAT = 6.0  # grey levels between the 2nd and 98th percentile of the blurred picture: one surface fills it
_UNRELATED = 0.25  # correlation of neighbouring pixels: lenses blur, noise does not
_LEAST_SQUARE = 6.0  # px: whatever stands on smaller squares cannot be seen
_BLUR = 15  # px
_EVERY = 8  # rows: neighbours along every eighth say enough


def blind_reason(picture: Picture) -> BoardNotFoundError | None:
    """Darkness, a covered lens, noise: what keeps a picture from showing anything; None when nothing does."""
    grey = np.asarray(cv2.cvtColor(picture[::2, ::2], cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    brightest = float(np.percentile(grey[::2], 99))
    if brightest < _DARK:
        return BoardNotFoundError(
            f"The picture is dark: its brightest parts have {brightest:.0f} of 255 grey levels, at least "
            f"{_DARK:.0f} are needed.",
            hint="Switch on a light, or raise the camera's exposure.",
        )
    if _neighbours_agree(grey) < _UNRELATED:
        return BoardNotFoundError(
            "The picture is noise: neighbouring pixels have nothing to do with each other.",
            hint="Check the camera's cable and its light.",
        )
    low, high = np.percentile(cv2.blur(grey, (_BLUR, _BLUR))[::_EVERY], (2, 98))
    if high - low < _FLAT:
        return BoardNotFoundError(
            f"The picture shows one even surface: {high - low:.0f} grey levels from end to end.",
            hint="Uncover the lens, and see that the camera points at the board.",
        )
    return None


def _neighbours_agree(grey: Grey) -> float:
    """Correlation of the differences two pixels apart, over those one pixel apart: 1 - variance ratio."""
    values = grey[::_EVERY].astype(np.float64)
    spread = float(values.var())
    if spread == 0:
        return 1.0
    return 1.0 - float(np.mean((values[:, 1:] - values[:, :-1]) ** 2)) / (2 * spread)


def no_board(found: int) -> BoardNotFoundError:
    """Nothing like a board was seen."""
    seen = "no chequered pattern" if found == 0 else f"only {found} points where four squares meet"
    return BoardNotFoundError(
        f"There is no board in the picture: {seen}.",
        hint="Point the camera at the board, and see that most of its squares are in view and lit.",
    )


def two_boards() -> BoardNotFoundError:
    """Two windows are sure."""
    return BoardNotFoundError(
        "There are two boards in the picture.", hint="Leave only one in view, or turn the camera to it."
    )


def too_small(image_from_board: Array) -> BoardNotFoundError | None:
    """Squares of too few pixels, or seen too much from the side; None when they can be read."""
    side = _narrowest(image_from_board)
    if side >= _LEAST_SQUARE:
        return None
    return BoardNotFoundError(
        f"The board is too small or seen too much from the side: its squares are {side:.0f} px at the "
        f"narrowest, at least {_LEAST_SQUARE:.0f} are needed.",
        hint="Move the camera nearer or higher.",
    )


def _narrowest(image_from_board: Array) -> float:
    """The smaller extent in pixels of the square that is seen smallest."""
    points = moved(image_from_board, GRID).reshape(ROWS + 1, ROWS + 1, 2)
    a, b = points[:-1, 1:] - points[:-1, :-1], points[1:, :-1] - points[:-1, :-1]
    area = np.abs(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
    longest = np.maximum(np.linalg.norm(a, axis=-1), np.linalg.norm(b, axis=-1))
    return float((area / np.maximum(longest, 1e-9)).min())


def widest(image_from_board: Array) -> float:
    """Pixels of the larger diagonal of the board over its squares: what a square is long."""
    corners = moved(image_from_board, OUTER_CORNERS)
    diagonals = np.linalg.norm(corners[2:] - corners[:2], axis=1)
    return float(diagonals.max() / (ROWS * np.sqrt(2)))


def cut_off(placement: Placement, points: Array, size: tuple[int, int]) -> BoardNotFoundError | None:
    """Which side of the picture ends before the board does; None when all of it is in view.

    Args:
        placement: The best window.
        points: (64, 2) pixels of the middles of the squares, as ``placement.seen`` has them.
        size: Width and height of the picture.
    """
    missing = ~placement.seen.ravel()
    if not missing.any():
        return None
    width, height = size
    lost = points[missing]
    names = {
        "left": lost[:, 0] < 0,
        "right": lost[:, 0] > width - 1,
        "top": lost[:, 1] < 0,
        "bottom": lost[:, 1] > height - 1,
    }
    worst = max(names, key=lambda name: int(names[name].sum()))
    return BoardNotFoundError(
        f"The board is cut off at the {worst} edge of the picture: {int(missing.sum())} of 64 squares are "
        "out of view.",
        hint=f"Move the camera back or turn it: the {worst} side of the board is missing.",
    )


def uncertain(placement: Placement) -> BoardNotFoundError:
    """A pattern is there, but which part of it is the board cannot be told."""
    fewest = int(min((placement.rows > 0).sum(), (placement.columns > 0).sum()))
    if fewest < ROWS:
        return BoardNotFoundError(
            f"Only {fewest} rows of squares are visible, a board has {ROWS}.",
            hint="Move the camera back or higher until the whole board is in view and uncovered.",
        )
    return BoardNotFoundError(
        f"The chequered pattern in the picture goes on beyond {ROWS} by {ROWS} squares.",
        hint="Show a chess board; cover or avoid tiled floors and table cloths.",
    )

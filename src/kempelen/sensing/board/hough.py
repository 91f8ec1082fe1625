"""The thesis's way to the board, kept as a baseline: lines, their crossings, a grid fitted to those.

Grey, then binary (against the mean around), then Canny's edges; Hough's lines in two directions, near doubles
dropped; the crossings on the table's plane; for each crossing, pairs of its neighbours at right angles and of
equal length span a square, the square is put in each of the 64 cells of a board, and the board whose 81
points lie nearest to crossings wins. A least-squares fit to the crossings near its points ends it. Without a
plane the picture is taken for one, as if seen square on.
"""

import cv2
import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from kempelen.core.camera import Picture
from kempelen.core.errors import BoardNotFoundError
from kempelen.core.geometry import Array
from kempelen.sensing.board.corners import View
from kempelen.sensing.board.lattice import TINY, apply, fit_homography, inverse, lines_apart, window_sums
from kempelen.sensing.board.orientation import board_from_window, unmirrored
from kempelen.sensing.board.placement import GRID, ROWS
from kempelen.sensing.sighting import BoardSighting

_LONGEST = 1000  # px
_BLUR = 5  # px, before the threshold
_BLOCK = 0.12  # of the longest side: about what the threshold's mean is taken, a few squares
_BELOW = 3.0  # grey levels under the mean: even surfaces stay white
_CANNY = (50, 150)
_VOTES = 0.11  # of the longest side: pixels of edge that make a line; two or three squares
_STEP = np.radians(1.0)
_SAME_ANGLE = np.radians(25.0)  # within which lines belong to one of the two directions
_CLOSE = 0.008  # of the longest side: lines nearer than that are one
_MOST_LINES = 40  # a direction
_MOST_FOUND = 400  # the strongest; a board and a cluttered table have a hundred
_NEIGHBOURS = 6
_UNEQUAL = 0.15  # e1: by which the two sides of a square may differ in length
_SKEW = np.radians(8.0)  # e2: from a right angle
_MOST_MODELS = 500
_FAR = 0.5  # squares, at which the distance of a point stops to count
_GOOD = 0.16  # squares: mean distance of a model's points from crossings; half of _FAR is chance
_NEAR = 0.25
_ALTERNATION = 1.5  # deviations between light and dark squares; chance shows 0.5


def find_by_lines(picture: Picture, image_from_flat: Array | None = None) -> BoardSighting:
    """Where the board is.

    Args:
        picture: (height, width, 3) blue, green, red.
        image_from_flat: (3, 3) from pixels of a picture square on to the table to this one's.

    Raises:
        BoardNotFoundError: too few lines, or no grid among their crossings.
    """
    view = View.of(picture, _LONGEST)
    first, second = _two_directions(_lines(view))
    crossings, _ = apply(view.original_from_view, _crossings(first, second, view))
    image_from_flat = np.eye(3) if image_from_flat is None else image_from_flat
    flat, _ = apply(inverse(image_from_flat), crossings)
    model = _best_grid(flat)
    fitted, residual = _refined(model, flat)
    window = unmirrored(image_from_flat @ fitted)
    if abs(_contrast(picture, window)) < _ALTERNATION:
        raise _no_grid("a grid whose squares do not alternate")
    return BoardSighting(
        image_from_board=board_from_window(window, dark_corner=dark_corner(picture, window)),
        residual=residual,
        confidence=max(0.0, 1.0 - residual / _FAR),
        method="thesis",
    )


def _lines(view: View) -> Array:
    """(n, 2) rho and theta, the strongest first."""
    blurred = cv2.GaussianBlur(view.grey, (_BLUR, _BLUR), 0)
    block = round(_BLOCK * max(view.grey.shape)) | 1
    binary = cv2.adaptiveThreshold(blurred, 255, cv2.ADAPTIVE_THRESH_MEAN_C, cv2.THRESH_BINARY, block, _BELOW)
    edges = cv2.Canny(binary, *_CANNY)
    found = cv2.HoughLines(edges, 1.0, float(_STEP), round(_VOTES * max(view.grey.shape)))
    if found is None:
        raise _no_grid("no straight edges")
    return np.asarray(found, dtype=np.float64).reshape(-1, found.shape[-1])[:_MOST_FOUND, :2]


def _two_directions(lines: Array) -> tuple[Array, Array]:
    """The lines along the commonest direction, and those across it."""
    angles = lines[:, 1]
    first = _fullest(angles, np.ones(len(lines), dtype=bool))
    along = lines_apart(angles, first) < _SAME_ANGLE
    if along.all():
        raise _no_grid("edges in one direction only")
    second = _fullest(angles, ~along)
    across = ~along & (lines_apart(angles, second) < _SAME_ANGLE)
    return lines[along], lines[across]


def _fullest(angles: Array, wanted: npt.NDArray[np.bool_]) -> float:
    candidates = angles[wanted]
    counts = (lines_apart(candidates[:, None], candidates[None]) < _SAME_ANGLE / 2).sum(axis=1)
    return float(candidates[int(np.argmax(counts))])


def _crossings(first: Array, second: Array, view: View) -> Array:
    """(n, 2) pixels in the view where lines of the two directions meet, doubles dropped."""
    height, width = view.grey.shape
    least = _CLOSE * max(height, width)
    middle = np.array([(width - 1) / 2, (height - 1) / 2])
    first, second = _thinned(first, middle, least), _thinned(second, middle, least)
    a = np.stack([np.cos(first[:, 1]), np.sin(first[:, 1])], axis=1)
    b = np.stack([np.cos(second[:, 1]), np.sin(second[:, 1])], axis=1)
    turn = a[:, None, 0] * b[None, :, 1] - a[:, None, 1] * b[None, :, 0]
    turn = np.where(np.abs(turn) < TINY, TINY, turn)
    x = (first[:, None, 0] * b[None, :, 1] - second[None, :, 0] * a[:, None, 1]) / turn
    y = (second[None, :, 0] * a[:, None, 0] - first[:, None, 0] * b[None, :, 0]) / turn
    points = np.stack([x.ravel(), y.ravel()], axis=1)
    inside = ((points > 0) & (points < (width, height))).all(axis=1)
    if inside.sum() < ROWS + 1:
        raise _no_grid(f"{int(inside.sum())} crossings of straight edges")
    kept: Array = points[inside]
    return kept


def _thinned(lines: Array, middle: Array, least: float) -> Array:
    """Without lines that pass the picture's middle at nearly the same distance as a stronger one."""
    kept: list[Array] = []
    reach: list[float] = []
    flip = np.where(np.abs(lines[:, 1] - lines[0, 1]) > np.pi / 2, -1.0, 1.0)
    for line, sign in zip(lines, flip, strict=True):
        distance = sign * (line[0] - middle @ (np.cos(line[1]), np.sin(line[1])))
        if all(abs(distance - other) > least for other in reach):
            kept.append(line)
            reach.append(distance)
        if len(kept) == _MOST_LINES:
            break
    return np.array(kept)


def _best_grid(points: Array) -> Array:
    """(3, 3) affine map from squares to the plane: the model of least distance."""
    tree = cKDTree(points)
    origins, firsts, seconds = _corner_pairs(points, tree)
    best, least = None, np.inf
    cells = np.stack(np.meshgrid(np.arange(ROWS), np.arange(ROWS)), axis=-1).reshape(-1, 2)
    for origin, first, second in zip(origins, firsts, seconds, strict=True):
        side = float(np.hypot(*first) + np.hypot(*second)) / 2
        axes = np.stack([first, second])
        # every placement's points lie on one grid 17 wide: one query answers all 64
        wide = np.stack(np.meshgrid(np.arange(-ROWS, ROWS + 1), np.arange(-ROWS, ROWS + 1)), axis=-1)
        distance, _ = tree.query(origin + wide.reshape(-1, 2) @ axes, distance_upper_bound=_FAR * side)
        table = np.minimum(distance / side, _FAR).reshape(2 * ROWS + 1, 2 * ROWS + 1)
        low = ROWS - cells
        totals = window_sums(table, ROWS + 1, ROWS + 1)[low[:, 1], low[:, 0]]
        cell = int(np.argmin(totals))
        if totals[cell] < least:
            least = float(totals[cell])
            corner = origin - cells[cell] @ axes
            best = np.array(
                [[first[0], second[0], corner[0]], [first[1], second[1], corner[1]], [0.0, 0.0, 1.0]]
            )
    if best is None or least > _GOOD * len(GRID):
        raise _no_grid("crossings of edges that form no grid of 8 by 8 squares")
    return best


def _corner_pairs(points: Array, tree: cKDTree) -> tuple[Array, Array, Array]:
    """Crossings with two neighbours at right angles and equally far: (n, 2) each."""
    _, near = tree.query(points, k=min(_NEIGHBOURS + 1, len(points)))
    steps = points[near[:, 1:]] - points[:, None]
    count = steps.shape[1]
    one, other = (index.ravel() for index in np.meshgrid(np.arange(count), np.arange(count)))
    first, second = steps[:, one].reshape(-1, 2), steps[:, other].reshape(-1, 2)
    origin = np.repeat(points, len(one), axis=0)
    a, b = np.linalg.norm(first, axis=1), np.linalg.norm(second, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / (a * b)
    fits = (turn > np.cos(_SKEW)) & (np.abs(a - b) < _UNEQUAL * np.maximum(a, b))
    chosen = np.flatnonzero(fits)
    chosen = chosen[:: max(1, len(chosen) // _MOST_MODELS)]
    return origin[chosen], first[chosen], second[chosen]


def _refined(model: Array, points: Array) -> tuple[Array, float]:
    """Least squares over the crossings near the model's points, and their RMS distance in squares."""
    tree = cKDTree(points)
    for _ in range(3):
        placed, _unused = apply(model, GRID)
        side = np.sqrt(abs(np.linalg.det(model[:2, :2])))
        distance, nearest = tree.query(placed)
        good = distance < _NEAR * side
        fitted = fit_homography(GRID[good], points[nearest[good]]) if good.sum() > ROWS else None
        if fitted is None:
            break
        model = fitted
    residual = float(np.sqrt(np.mean(np.minimum(distance / side, _FAR) ** 2)))
    return model, residual


def dark_corner(picture: Picture, window: Array) -> bool:
    """Whether the squares of the origin's colour are the darker ones."""
    return _contrast(picture, window) > 0


def _contrast(picture: Picture, window: Array) -> float:
    """Deviations by which squares of the other colour are lighter than those of the origin's."""
    cells = GRID[(GRID < ROWS).all(axis=1)]
    pixels, _ = apply(window, cells + 0.5)
    size = np.array([picture.shape[1], picture.shape[0]])
    inside = ((pixels >= 0) & (pixels < size - 1)).all(axis=1)
    even = (cells.sum(axis=1) % 2 == 0)[inside]
    if even.all() or not even.any():
        return 0.0
    spots = pixels[inside].round().astype(int)
    values = picture[spots[:, 1], spots[:, 0]].astype(np.float64).sum(axis=1)
    dark, light = float(np.median(values[even])), float(np.median(values[~even]))
    scatter = np.median(np.abs(values - np.where(even, dark, light)))
    return (light - dark) / max(1.4826 * float(scatter), 1.0)


def _no_grid(seen: str) -> BoardNotFoundError:
    return BoardNotFoundError(
        f"The thesis's method found no board: {seen}.",
        hint="Use the method 'lattice', or clear the edge of the board.",
    )

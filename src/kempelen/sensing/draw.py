"""The annotated picture: what the tracker sees and what it makes of it."""

from collections.abc import Collection
from enum import StrEnum
from typing import TYPE_CHECKING

import cv2
import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Depth, Frame, Picture
from kempelen.core.geometry import Array
from kempelen.core.senses import BLACK, EMPTY, WHITE, Observation
from kempelen.sensing.depth.geometry import MARGIN, Mask
from kempelen.sensing.sighting import OUTER_CORNERS, BoardSighting

if TYPE_CHECKING:
    from kempelen.sensing.tracker import TrackerView

_FONT = cv2.FONT_HERSHEY_SIMPLEX
_INK = (255, 255, 255)
_SHADE = (30, 30, 30)
_MARKS = {EMPTY: (160, 160, 160), WHITE: (245, 245, 245), BLACK: (20, 20, 20)}
_UNSURE = (0, 165, 255)  # orange
_HAND = (60, 60, 230)
_GRID = (80, 200, 80)
_LEVELS = (-10.0, 110.0)  # mm, the range of the height map's colours
_FEW_NATS = 3.0
_SIDE = 34  # px of a square in the maps
_TITLE = 26

_PLANE = (200, 130, 40)
_PLANE_SHARE = 0.3
_NEAR_FAR = (5.0, 95.0)  # percentiles of the distances that the colours of a depth picture span

Canvas = npt.NDArray[np.uint8]


class Ground(StrEnum):
    """What is drawn on."""

    COLOUR = "colour"
    DEPTH = "depth"
    ABOVE = "above"  # heights over the board, from above


class Layer(StrEnum):
    """What may be drawn on it."""

    PLANE = "plane"  # the playing field
    LATTICE = "lattice"
    SQUARES = "squares"  # what stands on each, and where the reading is unsure
    HEIGHTS = "heights"  # mm over the board
    HAND = "hand"  # what is taken for one


def annotate(view: "TrackerView", width: int = 960) -> Picture:
    """The camera's picture with the board and each square's reading on it, the map of heights beside it.

    Args:
        view: Of a frame.
        width: Of the camera's part of the picture, px.
    """
    picture = _camera_picture(view, width)
    panels = [_heights_panel(view), _likelihood_panel(view.observation)]
    column = np.vstack([panel for panel in panels if panel is not None])
    height = max(picture.shape[0], column.shape[0])
    return np.hstack([_padded(picture, height), _padded(column, height)])


def layered(
    view: "TrackerView", ground: Ground, layers: Collection[Layer], width: int = 960
) -> Picture | None:
    """One picture with the chosen layers on it; None where the frame has nothing of that kind.

    Args:
        view: Of a frame.
        ground: What is drawn on.
        layers: What is drawn; on the heights from above they are always there, hand included.
        width: Of the picture, px.
    """
    if ground is Ground.ABOVE:
        return _heights_panel(view)
    frame = view.frame
    if ground is Ground.DEPTH:
        source = None if frame.depth is None else _coloured(frame.depth)
        fits = _registered(frame)
    else:
        source, fits = frame.colour, True
    if source is None:
        return None
    scale = width / source.shape[1]
    canvas = _resized(source, width, scale)
    if view.sighting is not None and fits:
        _draw_layers(canvas, view, view.sighting, layers, scale)
    return canvas


def _registered(frame: Frame) -> bool:
    """Whether the depth picture shows what the colour picture does, pixel by pixel."""
    same = frame.depth_camera is not None and frame.depth_camera == frame.colour_camera
    return same and np.allclose(frame.colour_from_depth.matrix, np.eye(4), atol=1e-6)


def _draw_layers(
    canvas: Canvas, view: "TrackerView", sighting: BoardSighting, layers: Collection[Layer], scale: float
) -> None:
    seen = view.observation
    if Layer.PLANE in layers:
        outline = np.array(_points(sighting, OUTER_CORNERS, scale), np.int32)
        filled = cv2.fillPoly(canvas.copy(), [outline], _PLANE)
        cv2.addWeighted(filled, _PLANE_SHARE, canvas, 1 - _PLANE_SHARE, 0, canvas)
    if Layer.HAND in layers and view.hand is not None:
        _draw_hand(canvas, view.hand, sighting, scale)
    if Layer.LATTICE in layers:
        _draw_board(canvas, sighting, scale)
    if Layer.SQUARES in layers and seen.valid:
        _draw_squares(canvas, sighting, seen, scale)
    if Layer.HEIGHTS in layers and seen.valid and seen.heights is not None:
        for square, at in enumerate(_points(sighting, _centres(), scale)):
            if seen.log_likelihood[square].argmax() != EMPTY and np.isfinite(seen.heights[square]):
                _write(canvas, f"{seen.heights[square]:.0f}", (at[0] + 9, at[1] + 4), 0.4)


def _draw_hand(canvas: Canvas, hand: Mask, sighting: BoardSighting, scale: float) -> None:
    """Cells are measured over the board's plane: what is higher appears farther from the camera's foot."""
    cells = hand.shape[0] / (8 + 2 * MARGIN)
    squares_from_cells = np.array([[1 / cells, 0, -MARGIN], [0, 1 / cells, -MARGIN], [0, 0, 1]])
    pixels = np.diag([scale, scale, 1.0]) @ sighting.image_from_board @ squares_from_cells
    size = (canvas.shape[1], canvas.shape[0])
    over = cv2.warpPerspective(hand.astype(np.uint8), pixels, size, flags=cv2.INTER_NEAREST) > 0
    canvas[over] = (0.5 * canvas[over] + 0.5 * np.array(_HAND)).astype(np.uint8)


def _coloured(depth: Depth) -> Canvas:
    """Near is bright; what was not measured is black."""
    known = depth > 0
    if not known.any():
        return np.zeros((*depth.shape, 3), np.uint8)
    near, far = np.percentile(depth[known], _NEAR_FAR)
    shown = np.clip(255 * (far - depth) / max(far - near, 1.0), 0, 255).astype(np.uint8)
    canvas: Canvas = np.asarray(cv2.applyColorMap(shown, cv2.COLORMAP_VIRIDIS), np.uint8)
    canvas[~known] = 0
    return canvas


def _resized(picture: Canvas, width: int, scale: float) -> Canvas:
    size = (width, max(round(picture.shape[0] * scale), 1))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)


def _centres() -> Array:
    """(64, 2) squares of the board plane."""
    return np.stack([np.arange(64) % 8 + 0.5, np.arange(64) // 8 + 0.5], axis=-1)


def _camera_picture(view: "TrackerView", width: int) -> Canvas:
    colour = view.frame.colour
    if colour is None:
        blank = np.zeros((round(width * 9 / 16), width, 3), np.uint8)
        return _titled(blank, view.observation)
    scale = width / colour.shape[1]
    canvas = _resized(colour, width, scale)
    if view.sighting is not None:
        _draw_board(canvas, view.sighting, scale)
        if view.observation.valid:
            _draw_squares(canvas, view.sighting, view.observation, scale)
    return _titled(canvas, view.observation)


def _draw_board(canvas: Canvas, sighting: BoardSighting, scale: float) -> None:
    for k in range(9):
        for ends in ([[k, 0], [k, 8]], [[0, k], [8, k]]):
            start, end = _points(sighting, np.array(ends, dtype=np.float64), scale)
            cv2.line(canvas, start, end, _GRID, 1, cv2.LINE_AA)
    for square, name in ((0, "a1"), (7, "h1"), (63, "h8"), (56, "a8")):
        centre = np.array([[square % 8 + 0.5, square // 8 + 0.5]])
        outwards = centre + 0.9 * np.sign(centre - 4)
        _write(canvas, name, _points(sighting, outwards, scale)[0])


def _draw_squares(canvas: Canvas, sighting: BoardSighting, seen: Observation, scale: float) -> None:
    """A disc for each piece in its colour; a ring in orange where the reading is unsure."""
    best = seen.log_likelihood.argmax(axis=1)
    ordered = np.sort(seen.log_likelihood, axis=1)
    occupied = np.logaddexp(seen.log_likelihood[:, WHITE], seen.log_likelihood[:, BLACK])
    unsure = np.abs(occupied - seen.log_likelihood[:, EMPTY]) < _FEW_NATS
    colourless = ordered[:, 2] - ordered[:, 1] < _FEW_NATS
    for square, at in enumerate(_points(sighting, _centres(), scale)):
        if best[square] != EMPTY:
            grey = (128, 128, 128) if colourless[square] else _MARKS[int(best[square])]
            cv2.circle(canvas, at, 7, grey, -1, cv2.LINE_AA)
            cv2.circle(canvas, at, 7, _GRID, 1, cv2.LINE_AA)
        if unsure[square]:
            cv2.circle(canvas, at, 11, _UNSURE, 2, cv2.LINE_AA)


def _heights_panel(view: "TrackerView") -> Canvas | None:
    """Heights from above, a8 at the top left, the hand in red; numbers are mm."""
    if view.heights is None:
        return None
    low, high = _LEVELS
    shown = np.nan_to_num((view.heights[::-1] - low) / (high - low), nan=0.0)
    levels = np.clip(255 * shown, 0, 255).astype(np.uint8)
    canvas: Canvas = np.asarray(cv2.applyColorMap(levels, cv2.COLORMAP_VIRIDIS), np.uint8)
    canvas[np.isnan(view.heights[::-1])] = 0
    if view.hand is not None:
        canvas[view.hand[::-1]] = _HAND
    side = round((8 + 2 * MARGIN) * _SIDE)
    canvas = np.asarray(cv2.resize(canvas, (side, side), interpolation=cv2.INTER_NEAREST), np.uint8)
    edge = round(MARGIN * _SIDE)
    cv2.rectangle(canvas, (edge, edge), (side - edge, side - edge), _GRID, 1)
    heights = view.observation.heights
    if heights is not None:
        for square in np.flatnonzero(view.observation.log_likelihood.argmax(axis=1) != EMPTY).tolist():
            row, column = 7 - square // 8, square % 8
            at = (edge + column * _SIDE + 8, edge + row * _SIDE + 21)
            _write(canvas, f"{heights[square]:.0f}", at, 0.36)
    return _headed(canvas, "heights, mm")


def _likelihood_panel(seen: Observation) -> Canvas:
    """Probabilities of each square: height of the bar occupied, its shade the colour; a8 at the top left."""
    side = round((8 + 2 * MARGIN) * _SIDE)
    canvas: Canvas = np.full((side, side, 3), 60, np.uint8)
    edge = round(MARGIN * _SIDE)
    for square, (empty, white, black) in enumerate(seen.occupancy):
        row, column = 7 - square // 8, square % 8
        left, bottom = edge + column * _SIDE, edge + (row + 1) * _SIDE
        cv2.rectangle(canvas, (left, bottom - _SIDE), (left + _SIDE, bottom), (90, 90, 90), 1)
        if not seen.valid:
            continue
        share = white / max(white + black, 1e-12)
        level = round(20 + 225 * share)
        top = bottom - round((1 - empty) * (_SIDE - 4))
        cv2.rectangle(canvas, (left + 4, top), (left + _SIDE - 4, bottom - 2), (level, level, level), -1)
    return _headed(canvas, "occupied, colour")


def _titled(canvas: Canvas, seen: Observation) -> Canvas:
    text = seen.sight.value if seen.valid else f"{seen.sight.value}: {seen.message}"
    return _headed(canvas, text)


def _headed(canvas: Canvas, text: str) -> Canvas:
    head: Canvas = np.full((_TITLE, canvas.shape[1], 3), _SHADE, np.uint8)
    plain = text.encode("ascii", "replace").decode("ascii")  # OpenCV's fonts know no more
    cv2.putText(head, plain, (8, 18), _FONT, 0.45, _INK, 1, cv2.LINE_AA)
    return np.vstack([head, canvas])


def _write(canvas: Canvas, text: str, at: tuple[int, int], size: float = 0.45) -> None:
    cv2.putText(canvas, text, at, _FONT, size, _SHADE, 3, cv2.LINE_AA)
    cv2.putText(canvas, text, at, _FONT, size, _INK, 1, cv2.LINE_AA)


def _points(sighting: BoardSighting, places: Array, scale: float) -> list[tuple[int, int]]:
    pixels = np.rint(np.clip(sighting.pixels(places) * scale, -1e4, 1e4)).astype(int)
    return [(int(x), int(y)) for x, y in pixels]


def _padded(canvas: Canvas, height: int) -> Canvas:
    return np.pad(canvas, ((0, height - canvas.shape[0]), (0, 0), (0, 0)))

"""The board found in frames: by lattice, by the thesis's lines, by OpenCV."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import chess
import cv2
import numpy as np

from kempelen.core.camera import Frame, Intrinsics, Picture
from kempelen.core.errors import BoardNotFoundError
from kempelen.core.geometry import Transform
from kempelen.sensing.board import hough, reasons
from kempelen.sensing.board.fit import fit_board
from kempelen.sensing.board.follow import follow_board
from kempelen.sensing.board.lattice import inverse
from kempelen.sensing.board.orientation import (
    Side,
    board_from_window,
    turned_by_position,
    turned_to,
    unmirrored,
)
from kempelen.sensing.board.placement import ROWS
from kempelen.sensing.board.plane import depth_points, find_plane, find_table, image_from_plane, meet
from kempelen.sensing.board.pose import camera_from_board
from kempelen.sensing.board.search import Candidate, search
from kempelen.sensing.depth.plane import Plane
from kempelen.sensing.sighting import BoardSighting

METHODS = ("lattice", "thesis", "opencv")
"""How a board is looked for: our own way, the thesis's (Hough's lines), ``findChessboardCornersSB``."""

_UNEVEN = 0.06  # of a side: what depth noise and a bent board make of the sides of a square
_UNLIKE = 0.15  # of the square's side that was told, by which the measured one may differ
_MISFIT = 0.12  # squares RMS that a pose may leave: more, and picture and intrinsics do not belong together
_FLAT_LONGEST = 1600  # px, of the picture square on to the table
_LEAST_PICTURE = 64  # px: no board of 8 squares with corners fits in less
_INNER = ROWS - 1
_FULL = 6  # men on a rank of 8 from which they may hide it when seen from the side


class BoardFinder:
    """Finds the board and follows it.

    Args:
        method: One of :data:`METHODS`.
        square: Side of a square, mm; measured where there is depth, unknown otherwise, when None.
        side: Where White sits in the picture, if the operator has said so.
        usual_side: Where White was seen to sit before; for positions whose few men do not tell.

    Raises:
        ValueError: no such method, or a square of no size.
    """

    def __init__(
        self,
        method: str = "lattice",
        *,
        square: float | None = None,
        side: Side | None = None,
        usual_side: Side | None = None,
    ) -> None:
        if method not in METHODS:
            raise ValueError(f"no method '{method}' to find a board: one of {', '.join(METHODS)}")
        if square is not None and not square > 0:
            raise ValueError(f"a square of {square} mm")
        self.method = method
        self.square = square
        self.side = side
        self.usual_side = usual_side

    def find(self, frame: Frame, position: chess.BaseBoard | None = None) -> BoardSighting:
        """Where the board is.

        Args:
            frame: With colour; depth and intrinsics are used where they are there.
            position: What stands on the board, if known: it tells a1 from h8, and which ranks men may hide.

        Raises:
            BoardNotFoundError: there is none, two, half of one, or too little light; the message says which.
        """
        picture = _colour(frame)
        plane: Plane | None = None
        if self.method == "thesis":
            plane = _table(frame)
            found = self._by_lines(picture, frame, plane)
        else:
            found = self._by_corners(picture, frame, position)
        sighting = self._measured(found, frame, plane)
        return self._oriented(sighting, picture, position)

    def find_in_picture(self, picture: Picture, position: chess.BaseBoard | None = None) -> BoardSighting:
        """Where the board is in a picture (height, width, 3) of an unknown camera; see :meth:`find`."""
        return self.find(Frame(0, 0.0, colour=picture), position)

    def follow(self, frame: Frame, last: BoardSighting) -> BoardSighting | None:
        """The last sighting where it holds, corrected where the board moved a little; None: search again.

        See :func:`kempelen.sensing.board.follow.follow_board` on what its confidence means.
        """
        followed = follow_board(_colour(frame), last)
        if followed is None or followed.image_from_board is last.image_from_board:
            return followed
        try:
            return self._measured(followed, frame, None)
        except BoardNotFoundError:
            return None

    def _by_corners(self, picture: Picture, frame: Frame, position: chess.BaseBoard | None) -> BoardSighting:
        seek: Callable[[Picture], BoardSighting] = _find_by_opencv
        if self.method == "lattice":
            seek = partial(_find_lattice, full_ends=position is not None and _full_ends(position))
        try:
            return seek(picture)
        except BoardNotFoundError:
            if (
                frame.depth is None
                or frame.colour_camera is None
                or reasons.blind_reason(picture) is not None
            ):
                raise
            found = _square_on(seek, picture, frame)
            if found is None:
                raise
            return found

    @staticmethod
    def _by_lines(picture: Picture, frame: Frame, plane: Plane | None) -> BoardSighting:
        """The thesis's route; without depth the picture is taken for the plane, as if seen square on."""
        if plane is None or frame.colour_camera is None:
            return hough.find_by_lines(picture)
        image_from_flat, _ = image_from_plane(plane, frame.colour_camera)
        return hough.find_by_lines(picture, image_from_flat)

    def _measured(self, sighting: BoardSighting, frame: Frame, plane: Plane | None) -> BoardSighting:
        """With the side of a square and the pose, as far as depth and intrinsics allow.

        Raises:
            BoardNotFoundError: what was found is no square in space, or of another size than was said.
        """
        camera = frame.colour_camera
        square = self.square
        if frame.depth is not None and camera is not None:
            square = self._side_from_depth(sighting, frame, camera, plane)
        if square is None or camera is None:
            return replace(sighting, square=square)
        pose = camera_from_board(sighting.image_from_board, square, camera)
        if pose is None or pose[1] > _MISFIT * reasons.widest(sighting.image_from_board):
            raise BoardNotFoundError(
                "What looks like a board is no square in space for this camera: its perspective does not fit "
                "the intrinsics.",
                hint="Check the camera's calibration; a cropped or resized picture needs its own.",
            )
        return replace(sighting, square=square, camera_from_board=pose[0])

    def _side_from_depth(
        self, sighting: BoardSighting, frame: Frame, camera: Intrinsics, plane: Plane | None
    ) -> float | None:
        """Mean side of the squares, mm; what was told where the depth on the board says nothing."""
        if plane is None:
            try:
                plane = find_plane(depth_points(frame, sighting.image_from_board))
            except BoardNotFoundError:
                return self.square
        corners = meet(plane, camera.rays(sighting.corners))
        sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
        across = np.linalg.norm(corners[:2] - corners[2:], axis=1) / np.sqrt(2)
        mean = float(sides.mean())
        if not np.isfinite(mean) or max(np.ptp(sides), np.ptp(across)) > 2 * _UNEVEN * mean:
            raise BoardNotFoundError(
                "What looks like a board is no square in space: its sides measure "
                f"{', '.join(f'{side:.0f}' for side in sides)} mm.",
                hint="Check that colour and depth belong together, and that the board lies flat.",
            )
        square = mean / ROWS
        if self.square is not None and abs(square - self.square) > _UNLIKE * self.square:
            raise BoardNotFoundError(
                f"The board's squares measure {square:.1f} mm, but {self.square:g} mm was said (15 % either "
                "way is allowed).",
                hint="Correct the side of the squares, or the depth camera's calibration.",
            )
        return square if self.square is None else self.square

    def _oriented(
        self, sighting: BoardSighting, picture: Picture, position: chess.BaseBoard | None
    ) -> BoardSighting:
        turned = sighting
        if self.side is not None:
            turned = turned_to(sighting, self.side)
        elif position is not None:
            turned = turned_by_position(sighting, picture, position)
            if not turned.oriented and self.usual_side is not None:
                turned = turned_to(sighting, self.usual_side)
        if turned.image_from_board is sighting.image_from_board or sighting.camera_from_board is None:
            return turned
        return replace(turned, camera_from_board=_half_turned_pose(sighting))


def _find_lattice(picture: Picture, *, full_ends: bool = False) -> BoardSighting:
    """By X-corners."""
    found: Candidate = search(picture, full_ends=full_ends)
    return BoardSighting(
        image_from_board=board_from_window(found.fit.pixels_from_window, dark_corner=found.dark_corner),
        residual=found.fit.residual,
        confidence=found.confidence,
        method="lattice",
    )


def _find_by_opencv(picture: Picture) -> BoardSighting:
    """By ``findChessboardCornersSB``, which needs all 49 inner corners."""
    grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
    found, corners = cv2.findChessboardCornersSB(grey, (_INNER, _INNER), flags=flags)
    if not found:
        raise BoardNotFoundError(
            "OpenCV finds no board: it needs all 49 inner corners in sight.",
            hint="Clear the board, or use the method 'lattice'.",
        )
    pixels = np.asarray(corners, dtype=np.float64).reshape(-1, 2)
    places = np.stack(np.meshgrid(np.arange(1.0, ROWS), np.arange(1.0, ROWS)), axis=-1).reshape(-1, 2)
    fitted = fit_board(places, pixels)
    if fitted is None:
        raise BoardNotFoundError("OpenCV's corners form no board.", hint="Use the method 'lattice'.")
    window = unmirrored(fitted.pixels_from_window)
    dark = hough.dark_corner(picture, window)
    return BoardSighting(board_from_window(window, dark_corner=dark), fitted.residual, 1.0, "opencv")


def _full_ends(position: chess.BaseBoard) -> bool:
    """Whether men hide most of the first and of the last rank."""
    ends = (chess.BB_RANK_1, chess.BB_RANK_8)
    return all(len(chess.SquareSet(position.occupied & rank)) >= _FULL for rank in ends)


def _square_on(
    seek: Callable[[Picture], BoardSighting], picture: Picture, frame: Frame
) -> BoardSighting | None:
    """Sought in the picture as seen square on to the table: what perspective hides comes out there."""
    plane, camera = _table(frame), frame.colour_camera
    if plane is None or camera is None:
        return None
    image_from_flat, (width, height) = image_from_plane(plane, camera)
    factor = min(1.0, _FLAT_LONGEST / max(width, height))
    image_from_small = image_from_flat @ np.diag([1 / factor, 1 / factor, 1.0])
    size = (max(1, round(width * factor)), max(1, round(height * factor)))
    flat = cv2.warpPerspective(picture, inverse(image_from_small), size, borderMode=cv2.BORDER_REPLICATE)
    try:
        found = seek(np.asarray(flat, dtype=np.uint8))
    except BoardNotFoundError:
        return None
    return replace(found, image_from_board=image_from_small @ found.image_from_board)


def _table(frame: Frame) -> Plane | None:
    """The plane that most of the depth picture lies on; None without one."""
    if frame.depth is None:
        return None
    try:
        return find_table(depth_points(frame))
    except BoardNotFoundError:
        return None


def _half_turned_pose(sighting: BoardSighting) -> Transform:
    pose, square = sighting.camera_from_board, sighting.square
    if pose is None or square is None:
        raise ValueError("a sighting without a pose has none to turn")
    return pose @ Transform.about_z(np.pi, (ROWS * square, ROWS * square, 0.0))


def _colour(frame: Frame) -> Picture:
    """The frame's colour picture.

    Raises:
        BoardNotFoundError: it has none, or it is no (height, width, 3) array of bytes.
    """
    picture = frame.colour
    if picture is None or picture.ndim != 3 or picture.shape[2] != 3 or picture.dtype != np.uint8:  # noqa: PLR2004 - three colours
        shape = "none" if picture is None else f"one of shape {picture.shape} and type {picture.dtype}"
        raise BoardNotFoundError(
            f"The board is found in colour pictures (height, width, 3) of bytes; this frame has {shape}.",
            hint="Choose a camera or a stream with colour.",
        )
    if min(picture.shape[:2]) < _LEAST_PICTURE:
        raise BoardNotFoundError(
            f"The picture has {picture.shape[1]} x {picture.shape[0]} px, at least {_LEAST_PICTURE} either "
            "way are needed.",
            hint="Choose a larger format of the camera.",
        )
    return picture

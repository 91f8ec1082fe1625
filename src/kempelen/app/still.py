"""A position read from one picture, without any history."""

from dataclasses import dataclass, replace

import chess
import numpy as np

from kempelen.core.camera import Frame
from kempelen.core.errors import BoardNotFoundError, CalibrationError, SensorError
from kempelen.core.geometry import Array
from kempelen.core.senses import EMPTY
from kempelen.sensing.board.finder import BoardFinder
from kempelen.sensing.board.orientation import Side, half_turned, turned_to
from kempelen.sensing.cameras.picture import PictureCamera
from kempelen.sensing.depth.reader import DepthReader
from kempelen.sensing.kinds.classifier import PieceClassifier
from kempelen.sensing.moves.evidence import normalised
from kempelen.sensing.moves.placement import Placement, placement
from kempelen.sensing.sighting import BoardSighting

_OWN_HALF = 2.0
"""Log odds for each man more that stands in its own half of the board than in the other one."""


@dataclass(frozen=True, slots=True, eq=False)
class StillRead:
    """What one picture shows.

    Attributes:
        sighting: Where the board is.
        placement: What stands on it.
        oriented: Probability that a1 is where it is said to be.
        depth: Whether depth was used.
        note: Why depth was not used although it was there.
    """

    sighting: BoardSighting
    placement: Placement
    oriented: float
    depth: bool
    note: str = ""


def load_still(picture: str, depth: str | None) -> Frame:
    """A picture, and a depth picture registered to it.

    Raises:
        CameraError: a file is absent, no picture, or they do not fit each other.
        SensorError: there is nothing in it.
    """
    with PictureCamera(picture, depth=depth) as camera:
        frame = camera.read(0.0)
    if frame is None:
        raise SensorError(f"{picture} shows nothing.", hint="Name a picture of a chessboard.")
    return frame


def read_still(frame: Frame, side: Side | None = None) -> StillRead:
    """Find the board and name its pieces.

    Args:
        frame: With colour; depth is used where it can be.
        side: Of the picture at which White sits; None: told by the pieces.

    Raises:
        BoardNotFoundError: there is no whole board; the message says why.
        SensorError: the pieces cannot be read.
    """
    if frame.colour is None:
        raise BoardNotFoundError("There is no colour picture.", hint="Give one with --image.")
    sighting = BoardFinder().find(frame)
    if side is not None:
        sighting = turned_to(sighting, side)
    classifier = PieceClassifier()
    readings = []
    for turned in _turns(sighting):
        kinds = normalised(classifier.read(frame.colour, turned))
        occupied, note = _depth(frame, turned)
        if occupied is not None:
            kinds = kinds + np.where(np.arange(kinds.shape[1]) == EMPTY, occupied[:, :1], occupied[:, 1:2])
        read = placement(kinds)
        readings.append((_score(kinds, read.board), StillRead(turned, read, 1.0, occupied is not None, note)))
    readings.sort(key=lambda scored: -scored[0])
    best = readings[0][1]
    if len(readings) == 1:
        return best
    odds = readings[0][0] - readings[1][0]
    return replace(best, oriented=float(1 / (1 + np.exp(-odds))))


def _turns(sighting: BoardSighting) -> list[BoardSighting]:
    """The two ways of sitting at a board whose a1 is dark, unless it is known which."""
    if sighting.oriented:
        return [sighting]
    image = half_turned(sighting.image_from_board)
    return [sighting, replace(sighting, image_from_board=image, camera_from_board=None)]


def _depth(frame: Frame, sighting: BoardSighting) -> tuple[Array | None, str]:
    """(64, 3) log-likelihoods by depth; None and why, where it cannot be used."""
    if frame.depth is None:
        return None, ""
    reader = DepthReader()
    try:
        reader.learn([frame], sighting)
        return reader.read(frame).log_likelihood, ""
    except (CalibrationError, BoardNotFoundError) as error:
        return None, f"The depth picture is not used: {error}"


def _score(kinds: Array, board: chess.BaseBoard) -> float:
    """Log-likelihood of a placement, and of the side that White sits at: men start in their own half."""
    rows = [_column(board.piece_at(square)) for square in chess.SQUARES]
    seen = float(kinds[np.arange(64), rows].sum())
    at_home = sum(
        (1 if (chess.square_rank(square) < 4) == piece.color else -1)  # noqa: PLR2004 - the board's middle
        for square, piece in board.piece_map().items()
    )
    return seen + _OWN_HALF * at_home


def _column(piece: chess.Piece | None) -> int:
    """Of an observation's kinds."""
    if piece is None:
        return EMPTY
    return piece.piece_type + (0 if piece.color else 6)

"""Labelled photos and depth pictures.

A folder of them has ``board-photos``, ``game-photos`` and ``rgbd``, each with ``labels.json``; any may
be missing. Nothing of them is part of this project; ``--data`` or ``KEMPELEN_REAL_DATA`` says where they are.
"""

import hashlib
import json
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from kempelen.core.camera import Depth, Frame, Intrinsics, Picture
from kempelen.core.errors import BoardNotFoundError, ConfigError
from kempelen.core.geometry import Array
from kempelen.sensing.board.finder import BoardFinder
from kempelen.sensing.board.orientation import four_turns
from kempelen.sensing.sighting import OUTER_CORNERS, BoardSighting

VARIABLE = "KEMPELEN_REAL_DATA"
FOLDERS = ("board-photos", "game-photos", "rgbd")
_USUAL = Path("../shared/real")  # beside the project, when run from its root
RGBD_CAMERA = Intrinsics(848, 480, 616.0, 616.0, 424.0, 240.0)
"""Of the rgbd pictures: not recorded with them, but fits their boards."""


@dataclass(frozen=True, slots=True)
class Labelled:
    """One picture and what is known of it.

    Attributes:
        folder: One of :data:`FOLDERS`.
        path: Of the colour picture.
        label: Its entry in ``labels.json``.
    """

    folder: str
    path: Path
    label: dict[str, Any]

    @property
    def corners(self) -> Array:
        """(4, 2) pixels of the outer corners, the top left one first, clockwise."""
        return np.asarray(self.label["corners_px"], dtype=np.float64)

    @property
    def digest(self) -> str:
        """SHA-256 of the file: the same picture has it in any folder and under any name."""
        return hashlib.sha256(self.path.read_bytes()).hexdigest()

    def sighting(self) -> BoardSighting:
        """The board as it is labelled: the first corner is a8's."""
        return sighting_of(self.corners)

    def found(self, finder: BoardFinder, frame: Frame) -> BoardSighting | None:
        """The board as it is found in its frame, turned as it is labelled; None when it is not found."""
        try:
            found = finder.find(frame)
        except BoardNotFoundError:
            return None
        wanted = self.sighting().corners
        turned = [
            replace(found, image_from_board=image, camera_from_board=None)
            for image in four_turns(found.image_from_board)
        ]
        return min(turned, key=lambda sighting: float(np.linalg.norm(sighting.corners - wanted)))

    def picture(self) -> Picture:
        """Blue, green, red.

        Raises:
            ConfigError: the file cannot be read.
        """
        return np.asarray(_read(self.path, cv2.IMREAD_COLOR), dtype=np.uint8)

    def depth(self) -> Depth | None:
        """mm, registered to the colour picture; None for a photo.

        Raises:
            ConfigError: the file cannot be read.
        """
        if "depth" not in self.label:
            return None
        return np.asarray(
            _read(self.path.parent / self.label["depth"], cv2.IMREAD_UNCHANGED), dtype=np.float32
        )

    def frame(self) -> Frame:
        """All of it."""
        depth = self.depth()
        camera = None if depth is None else RGBD_CAMERA
        return Frame(0, 0.0, self.picture(), depth, camera, camera)


def sighting_of(corners: Array) -> BoardSighting:
    """From the (4, 2) outer corners of a8, h8, h1 and a1."""
    board = OUTER_CORNERS[[3, 2, 1, 0]].astype(np.float32)
    homography = cv2.getPerspectiveTransform(board, corners.astype(np.float32))
    return BoardSighting(np.asarray(homography, dtype=np.float64), 0.0, 1.0, "labels", oriented=True)


def data_folder(data: Path | None) -> Path:
    """The folder asked for, or that of the environment, or the usual one.

    Raises:
        ConfigError: it is not there, or holds none of the three.
    """
    folder = data or Path(os.environ.get(VARIABLE, _USUAL))
    if not any((folder / name / "labels.json").is_file() for name in FOLDERS):
        raise ConfigError(
            f"There are no labelled pictures in '{folder}': none of {', '.join(FOLDERS)} with a labels.json.",
            hint=f"Name a folder with --data, or in {VARIABLE}.",
        )
    return folder


def labelled(data: Path, folder: str) -> list[Labelled]:
    """All pictures of one folder; none when it is missing.

    Raises:
        ConfigError: its labels cannot be read.
    """
    path = data / folder / "labels.json"
    if not path.is_file():
        return []
    return [Labelled(folder, path.parent / entry["image"], entry) for entry in _entries(path)]


def labelled_moves(data: Path) -> list[dict[str, Any]]:
    """Pairs of game photos (``before``, ``after``, ``uci``); none when there are no labels.

    Raises:
        ConfigError: the labels cannot be read.
    """
    path = data / "game-photos" / "labels.json"
    if not path.is_file():
        return []
    labels = _json(path)
    return list(labels.get("moves", [])) if isinstance(labels, dict) else []


def _entries(path: Path) -> list[dict[str, Any]]:
    labels = _json(path)
    return list(labels["photos"] if isinstance(labels, dict) else labels)


def _json(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ConfigError(f"The labels '{path}' cannot be read: {error}.", hint="Check the file.") from error


def _read(path: Path, how: int) -> Any:
    picture = cv2.imread(str(path), how)
    if picture is None:
        raise ConfigError(f"The picture '{path}' cannot be read.", hint="Check that it is there and whole.")
    return picture

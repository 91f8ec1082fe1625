"""X-corners: the points where four squares meet, two dark and two light.

The response is that of ChESS (Bennett and Lasenby, "ChESS: quick and robust detection of chess-board
features", 2014) as the package ``chess_corners`` computes it; each corner comes with the directions of its
two edges, ordered so that the sector from the first to the second is dark. That order is what tells a corner
from its neighbours.
"""

from dataclasses import dataclass

import chess_corners
import cv2
import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Picture
from kempelen.core.geometry import Array

Grey = npt.NDArray[np.uint8]

_THRESHOLD = 15.0  # of the response, on a picture stretched to the full range; noise is left to the lattice
_MOST = 700  # corners kept, the strongest: five times what a board with a full set shows
_LARGEST_GAIN = 8.0  # of the stretch: beyond it a dark picture is only noise
_TAILS = (0.01, 0.99)  # of the histogram, that the stretch ignores


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A picture at the size it is searched at.

    Attributes:
        grey: (height, width) reduced and stretched to the full range.
        original_from_view: (3, 3) from pixels of the reduced picture to those of the original.
    """

    grey: Grey
    original_from_view: Array

    @classmethod
    def of(cls, picture: Picture, longest: int) -> "View":
        """The picture with its longest side at most ``longest`` px."""
        height, width = picture.shape[:2]
        factor = min(1.0, longest / max(height, width))
        grey = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
        if factor < 1.0:
            size = (max(1, round(width * factor)), max(1, round(height * factor)))
            grey = np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        across, down = width / grey.shape[1], height / grey.shape[0]
        back = np.array([[across, 0.0, (across - 1) / 2], [0.0, down, (down - 1) / 2], [0.0, 0.0, 1.0]])
        return cls(stretched(grey), back)


@dataclass(frozen=True, slots=True, eq=False)
class Corners:
    """X-corners of one view.

    Attributes:
        points: (n, 2) pixels of the view.
        axes: (n, 2) rad, directions of the two edges; from the first to the second lies a dark sector.
        response: (n,) strength.
    """

    points: Array
    axes: Array
    response: Array

    def __len__(self) -> int:
        return len(self.points)


def find_corners(grey: Grey) -> Corners:
    """The strongest X-corners of a picture."""
    found = _detector().detect(np.ascontiguousarray(grey))
    response = np.asarray(found.response, dtype=np.float64)
    best = np.argsort(-response, kind="stable")[:_MOST]
    points = np.asarray(found.xy, dtype=np.float64).reshape(-1, 2)[best]
    axes = np.asarray(found.angles, dtype=np.float64).reshape(-1, 2)[best]
    known = np.isfinite(axes).all(axis=1)
    return Corners(points[known], axes[known], response[best][known])


def stretched(grey: Grey) -> Grey:
    """The same with its histogram's tails at black and white, noise not blown up beyond reason."""
    counts = np.cumsum(np.bincount(grey[::2, ::2].ravel(), minlength=256))
    low, high = np.searchsorted(counts, np.multiply(_TAILS, counts[-1]))
    gain = min(_LARGEST_GAIN, 255.0 / max(1.0, float(high - low)))
    table = np.clip((np.arange(256) - float(low)) * gain, 0, 255).astype(np.uint8)
    return np.asarray(cv2.LUT(grey, table), dtype=np.uint8)


def _detector() -> chess_corners.Detector:
    settings = chess_corners.DetectorConfig()
    settings.threshold = _THRESHOLD
    settings.uncertainty = chess_corners.Uncertainty.OFF
    return chess_corners.Detector(settings)

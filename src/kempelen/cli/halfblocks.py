"""Pictures in a terminal: two pixels in each character, one above the other."""

import cv2
import numpy as np
from rich.color import Color
from rich.segment import Segment
from rich.segment import Segments as Picture
from rich.style import Style

from kempelen.core.camera import Picture as Pixels

UPPER_HALF = "▀"


def terminal_picture(pixels: Pixels, columns: int, rows: int) -> Picture:
    """A picture that fits into so many characters; its upper pixels are ink, its lower ones paper.

    Args:
        pixels: (height, width, 3) blue, green, red.
        columns: Of the terminal.
        rows: Of the terminal.
    """
    height, width = pixels.shape[:2]
    scale = min(columns / width, 2 * rows / height)
    size = max(1, round(width * scale)), 2 * max(1, round(height * scale / 2))
    small = np.asarray(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), np.uint8)
    lines = [_line(small[row], small[row + 1]) for row in range(0, size[1], 2)]
    return Picture([segment for line in lines for segment in line])


def _line(upper: Pixels, lower: Pixels) -> list[Segment]:
    cells = [
        Segment(UPPER_HALF, Style(color=_colour(above), bgcolor=_colour(below)))
        for above, below in zip(upper, lower, strict=True)
    ]
    return [*cells, Segment.line()]


def _colour(pixel: Pixels) -> Color:
    blue, green, red = (int(part) for part in pixel)
    return Color.from_rgb(red, green, blue)

"""What the colour reader does not estimate; shown and changed live like all parameters of the senses."""

from dataclasses import dataclass

from kempelen.core.errors import ConfigError


@dataclass(frozen=True, slots=True)
class ColourParameters:
    """Of the colour reader. Lengths are in squares.

    Attributes:
        pixels: Of a cut-out square's side; more than a webcam gives of a square helps nobody.
        heights: Of the slices of the column over a square that are looked at: the foot and the
            waist of a pawn. Standard sets have pawns of 0.75 to 0.9 squares; what is higher hides the
            square behind more often than it tells of its own.
        radii: Of the disc that is looked at in each slice; a foot is 0.55 to 0.8 squares wide (FIDE: 0.7
            to 0.8 for the king), a body narrower.
        focal: Focal length in terms of the picture's longer side, when nobody knows the intrinsics:
            phones and webcams have fields of view of 60 to 75 degrees.
        limit: Bound of what one square may say, nats.
        shadows: Copies of the known squares with invented shadows, per square.
        depth: Of the deepest invented shadow: natural logarithm of the light that is left, negated.
        shaded: Share of squares that lie in a shadow of their own.
        memory: Positions that are remembered; older ones were seen in another light.
        search: Pixels of a cut-out that a square may be out of register: a small error of the corners, or
            a camera that moved.
        weight: Of a square's evidence: its features are not quite independent, and no class quite Gaussian.
            0.25 to 0.5 made probabilities match frequencies best on 100 pairs of game photos.
        adaptation: Share by which the memory of a square follows what it looks like now, per reading.
    """

    pixels: int = 24
    heights: tuple[float, ...] = (0.05, 0.3)
    radii: tuple[float, ...] = (0.36, 0.3)
    focal: float = 0.73
    limit: float = 12.0
    shadows: int = 4
    depth: float = 1.3
    memory: int = 8
    search: int = 2
    weight: float = 0.5
    shaded: float = 0.06
    adaptation: float = 0.05

    def __post_init__(self) -> None:
        if len(self.heights) != len(self.radii) or not self.heights:
            raise ConfigError(
                f"The colour reader has {len(self.heights)} heights and {len(self.radii)} radii.",
                hint="Give each slice of the column its height and its radius.",
            )

"""Pictures of random boards with the truth about them: to train on and to test with.

For trackers' tests the truth is what they are measured against; no tracker sees it.
"""

import math
from dataclasses import dataclass, replace
from typing import Self

import chess
import numpy as np

from kempelen.core.camera import Frame, Intrinsics
from kempelen.core.geometry import Array, Transform
from kempelen.twin.cameras.camera import VirtualCamera
from kempelen.twin.cameras.models import KINECT_V2, CameraModel
from kempelen.twin.cameras.noise import NOMINAL, Noise
from kempelen.twin.cameras.settings import Lighting, Placement
from kempelen.twin.cameras.still import Still
from kempelen.twin.cameras.variety import random_lighting, random_placement, random_position, random_scene
from kempelen.twin.physics.scene import Scene

_VIEWS = (40.0, 75.0)
"""Horizontal fields of view of webcams and telephones, degrees."""
_MARGIN = 0.03
"""Of the picture, outside of the board."""
_STEPS_BACK = 30


@dataclass(frozen=True, slots=True, eq=False)
class Shot:
    """A picture and the truth.

    Attributes:
        frame: What the camera gives: a colour picture with its intrinsics; no depth.
        board: What stands on the squares.
        camera_from_board: True pose, mm, of the board in the colour camera's frame.
        square: Side of a square, mm.
        scene: Everything else.
    """

    frame: Frame
    board: chess.Board
    camera_from_board: Transform
    square: float
    scene: Scene

    def pixels(self, points: Array) -> Array:
        """(n, 2) true pixels of (n, 3) points of the board's frame, mm."""
        lens = self.frame.colour_camera
        if lens is None:
            raise ValueError("a studio's frame always has its intrinsics")
        return lens.project(self.camera_from_board @ points)

    @property
    def corners(self) -> Array:
        """(4, 2) true pixels of the outer corners of a1, h1, h8 and a8."""
        return self.pixels(_corners(self.square))


class Studio:
    """Takes pictures of one size. Context manager.

    Args:
        width: Pixels.
        height: Pixels.
        noise: Of the pictures.
        seed: Of the noise.
        backend: Way of drawing.
    """

    def __init__(
        self,
        width: int = 1280,
        height: int = 720,
        *,
        noise: Noise = NOMINAL,
        seed: int = 0,
        backend: str = "auto",
    ) -> None:
        self._size = (width, height)
        self._camera = VirtualCamera(
            _webcam(width, height, math.radians(60.0)), noise=noise, seed=seed, backend=backend, depth=False
        )
        self._still: Still | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exc: object) -> None:
        """Give back the camera."""
        self._camera.close()

    def render(
        self,
        rng: np.random.Generator,
        board: chess.Board | None = None,
        *,
        scene: Scene | None = None,
        placement: Placement | None = None,
        lighting: Lighting | None = None,
        elevation: tuple[float, float] = (20.0, 70.0),
    ) -> Shot:
        """A picture of a position; what is not given is drawn at random.

        Args:
            rng: Of all that is random but the noise.
            board: What stands on the squares, ``scene`` permitting.
            scene: Board and set; the same one twice is not built twice.
            placement: Of the camera.
            lighting: Lamp and exposure.
            elevation: Least and greatest angle of the view under the horizontal, degrees.
        """
        if board is None:
            board = random_position(rng)
        if scene is None:
            scene = random_scene(rng, board)
        if self._still is None or self._still.scene is not scene:
            self._still = Still(scene, machine=False)
        square = scene.table.square
        view = math.radians(rng.uniform(*_VIEWS))
        self._camera.model = _webcam(*self._size, view)
        if placement is None:
            least = 2 * math.atan(math.tan(view / 2) * min(1.0, self._size[1] / self._size[0]))
            placement = _whole(
                random_placement(rng, square, least, elevation), self._camera.model.colour, square
            )
        self._camera.change(placement=placement, lighting=lighting or random_lighting(rng, square))
        frame = self._camera.shoot(self._still)
        pose = self._camera.placement.board_from_camera.inverse()
        return Shot(frame, board, pose, square, scene)


def _webcam(width: int, height: int, view: float) -> CameraModel:
    """A colour camera with that horizontal field of view, rad."""
    return replace(KINECT_V2, name="webcam", colour=Intrinsics.of_view(width, height, view))


def _whole(placement: Placement, lens: Intrinsics, square: float) -> Placement:
    """From as far away as it takes for the whole board to be in the picture."""
    corners, room = _corners(square), _MARGIN * np.array([lens.width, lens.height])
    for _ in range(_STEPS_BACK):
        pixels = lens.project(placement.board_from_camera.inverse() @ corners)
        if (pixels > room).all() and (pixels < [lens.width, lens.height] - room).all():
            break
        away = 1.06 * np.subtract(placement.position, placement.target) + placement.target
        placement = placement.model_copy(update={"position": tuple(away.tolist())})
    return placement


def _corners(square: float) -> Array:
    """(4, 3) mm, board frame: the outer corners of a1, h1, h8 and a8."""
    side = 8 * square
    return np.array([[0, 0, 0], [side, 0, 0], [side, side, 0], [0, side, 0]], dtype=float)

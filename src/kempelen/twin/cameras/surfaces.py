"""What a depth camera's light meets: how far, how dark, how shiny, and how near a piece's foot."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Depth
from kempelen.core.geometry import Transform
from kempelen.twin.cameras.optics import DepthOptics, normals_angle
from kempelen.twin.cameras.render import Ids, geom_colours
from kempelen.twin.physics.appearance import BLACK, BOARD, WHITE
from kempelen.twin.physics.paint import board_paint, board_pixels, sampled
from kempelen.twin.physics.scene import Scene

_LUMINANCE = np.array([0.3, 0.59, 0.11])
_BRIGHTEST = 0.75
"""Luminance that reflects all the infrared light that anything does."""
GLOSSY_IR = 0.25
"""What reflects less than this and is varnished loses its light elsewhere."""
_FAR = 1e4
"""Farther from a piece than this, in pixels or mm, is as far as can be."""
_SHINY = 0.3
"""Gloss from which on a piece is varnished."""


@dataclass(frozen=True, slots=True, eq=False)
class Surfaces:
    """Without any noise.

    Attributes:
        depth: (h, w) mm, at the pixels' centres.
        angle: (h, w) between ray and normal, rad.
        infrared: (h, w) share of the infrared light that comes back; 1 is white.
        glossy: (h, w) whether it is varnished.
        foot_distance: (h, w) mm, to the nearest piece as seen in the picture.
        fine_depth: (fine h, fine w) mm.
        fine_infrared: (fine h, fine w), without the board's pattern.
    """

    depth: Depth
    angle: Depth
    infrared: Depth
    glossy: npt.NDArray[np.bool_]
    foot_distance: Depth
    fine_depth: Depth
    fine_infrared: Depth


class Materials:
    """Infrared properties of a model's geoms.

    Args:
        model: MuJoCo's.
        scene: What it was built from.

    Attributes:
        infrared: Of each geom, and of nothing (the last one).
        piece: Whether each geom is a piece's.
        board: Whether each is the board's top.
        glossy: Whether each is varnished.
    """

    def __init__(self, model: Any, scene: Scene) -> None:
        names = {name: int(model.material(name).id) for name in (WHITE, BLACK, BOARD)}
        colour, material, look = geom_colours(model), np.array(model.geom_matid), scene.look
        colour[material == names[BOARD]] = (np.array(look.light) + look.dark) / 2
        # One more row, for -1: nothing.
        self.infrared = np.append(_infrared(colour), 1.0).astype(np.float32)
        piece = np.isin(material, (names[WHITE], names[BLACK]))
        self.piece = np.append(piece, False)
        self.board = np.append(material == names[BOARD], False)
        self.glossy = np.append(piece & (look.gloss >= _SHINY), False)
        self._paint = _infrared(board_paint(look, scene.table.square) / 255.0).astype(np.float32)
        self.scene = scene

    def see(self, optics: DepthOptics, pose: Transform, drawn: tuple[Depth, Ids]) -> Surfaces:
        """What a camera at ``robot_from_camera`` meets, from its picture of depth and geoms."""
        fine_depth = np.asarray(optics.on_grid(drawn[0]), dtype=np.float32)
        fine_ids = np.asarray(optics.on_grid(drawn[1]), dtype=np.int16)
        middle = slice(optics.fine // 2, None, optics.fine)
        depth, ids = np.ascontiguousarray(fine_depth[middle, middle]), fine_ids[middle, middle]
        infrared = self.infrared[ids]
        board_from_camera = self.scene.table.robot_from_board.inverse() @ pose
        on_board = np.nonzero(self.board[ids])
        infrared[on_board] = self._painted(board_from_camera, optics.slopes[on_board], depth[on_board])
        return Surfaces(
            depth,
            normals_angle(depth, optics.slopes),
            infrared,
            self.glossy[ids],
            _distance(self.piece[ids], depth, optics),
            fine_depth,
            self.infrared[fine_ids],
        )

    def _painted(
        self, board_from_camera: Transform, slopes: npt.NDArray[np.float32], depth: Depth
    ) -> npt.NDArray[np.float32]:
        """(n,) the board's pattern where (n,) rays meet it."""
        ray = np.concatenate([slopes, np.ones((len(slopes), 1), np.float32)], axis=1)
        points = board_from_camera @ (ray * depth[:, None])
        return sampled(self._paint, board_pixels(self.scene.look, self.scene.table.square, points))


def _infrared(colour: npt.NDArray[np.floating]) -> npt.NDArray[np.floating]:
    """Share that comes back of a (..., 3) red, green, blue surface."""
    return np.asarray(np.clip(colour @ _LUMINANCE / _BRIGHTEST, 0.02, 1.2))


def _distance(piece: npt.NDArray[np.bool_], depth: Depth, optics: DepthOptics) -> Depth:
    """(h, w) mm from each pixel to the nearest one of a piece."""
    pixels = np.minimum(cv2.distanceTransform((~piece).astype(np.uint8), cv2.DIST_L2, 3), np.float32(_FAR))
    out: Depth = pixels * (depth * np.float32(optics.fine / optics.canvas.fx))
    return np.where(piece, np.float32(_FAR), out)  # on a piece itself: seen directly

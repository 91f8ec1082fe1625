"""Which part of a picture has to be drawn anew when something has moved."""

from itertools import product
from typing import Any, Self

import numpy as np

from kempelen.core.camera import Intrinsics
from kempelen.core.geometry import Array
from kempelen.twin.cameras.region import Region
from kempelen.twin.cameras.render import NEAR, View, drawn_geoms, lamp_and_board
from kempelen.twin.cameras.settings import Lighting
from kempelen.twin.physics.scene import Scene
from kempelen.twin.physics.units import METRES

_CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
_STILL = 1e-7
"""m, or sine of an angle: what moves less has not moved."""
_FLAT = 20.0
"""A lamp must be so much higher than a thing for its shadow to end somewhere, mm."""


class Poses:
    """Where all geoms of a model are.

    Args:
        model: MuJoCo's.
        data: After its kinematics.
    """

    def __init__(self, model: Any, data: Any) -> None:
        self._model = model
        self.places, self.turns = np.array(data.geom_xpos), np.array(data.geom_xmat)

    def changed(self, other: Self) -> Array:
        """Numbers of the drawn geoms that are elsewhere in the other."""
        shift = np.abs(self.places - other.places).max(axis=1)
        turn = np.abs(self.turns - other.turns).max(axis=1)
        return np.intersect1d(np.flatnonzero(np.maximum(shift, turn) > _STILL), drawn_geoms(self._model))

    def corners(self, geoms: Array) -> Array:
        """(8 n, 3) of the boxes round geoms, robot frame, mm."""
        boxes = self._model.geom_aabb[geoms]
        local = boxes[:, None, :3] + _CORNERS * boxes[:, None, 3:]
        turned = np.einsum("nij,nkj->nki", self.turns[geoms].reshape(-1, 3, 3), local)
        return np.asarray((turned + self.places[geoms, None]).reshape(-1, 3) / METRES)


def stale_points(before: Poses, after: Poses, scene: Scene, lighting: Lighting) -> Array:
    """(n, 3) mm, robot frame: all that looks different lies within the hull of these, shadows included."""
    geoms = before.changed(after)
    points = np.concatenate([before.corners(geoms), after.corners(geoms)])
    if not len(points) or not (lighting.shadows and lighting.on):
        return points
    lamp, _ = lamp_and_board(scene, lighting)
    fall = lamp[2] - np.minimum(points[:, 2], lamp[2] - _FLAT)
    shadows = lamp + (points - lamp) * ((lamp[2] - scene.table_top) / fall)[:, None]
    return np.concatenate([points, shadows])


def seen_region(points: Array, view: View) -> Region:
    """Part of a picture that holds (n, 3) points; all of it when one is beside or behind the camera."""
    if not len(points):
        return Region(0, 0, 0, 0)
    lens: Intrinsics = view.intrinsics
    local = view.robot_from_camera.inverse() @ points
    if local[:, 2].min() < NEAR:
        return Region.whole(lens)
    return Region.around(lens.project(local), lens)

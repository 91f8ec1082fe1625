"""Drawing by rays, where there is no OpenGL: the same geometry, and colours by Lambert's law."""

from typing import Any, Protocol

import mujoco
import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Depth, Picture
from kempelen.twin.cameras.region import Region
from kempelen.twin.cameras.render import (
    AMBIENT_SHARE,
    FAR,
    SPECULAR_SHARE,
    Ids,
    View,
    drawn_geoms,
    geom_colours,
    lamp_and_board,
)
from kempelen.twin.cameras.settings import Lighting
from kempelen.twin.cameras.shapes import Triangles
from kempelen.twin.physics.appearance import BOARD, TABLE
from kempelen.twin.physics.bodies import TABLE_HALF
from kempelen.twin.physics.paint import board_paint, board_pixels, sampled, table_paint
from kempelen.twin.physics.scene import Scene
from kempelen.twin.physics.units import METRES

_TOUCH = 1e-3
"""Of the way to the lamp: nearer to a point than that is the point itself."""
_CLOTH_MM = 200.0
"""Side of the table top's repeated picture."""
Floats = npt.NDArray[np.float32]
Hits = tuple[Floats, npt.NDArray[np.int32], Floats]


class Tracer(Protocol):
    """Finds what rays hit."""

    name: str

    def look(self, data: Any) -> None:
        """Take in where everything is."""
        ...

    def trace(self, origin: Floats, rays: Floats) -> Hits:
        """Of (n, 3) rays from one point, mm.

        Returns:
            (n,) multiples of the rays, inf for none; (n,) geoms, -1 for none; (n, 3) normals of any length.
        """
        ...


class EmbreeTracer:
    """By Embree, on triangles.

    Args:
        model: MuJoCo's.
    """

    name = "embree"

    def __init__(self, model: Any) -> None:
        from embreex import mesh_construction, rtcore_scene  # noqa: PLC0415 - not on every machine

        self._mesh, self._scene_of = mesh_construction.TriangleMesh, rtcore_scene.EmbreeScene
        self._triangles = Triangles(model)
        self._scene: Any = None

    def look(self, data: Any) -> None:
        """Take in where everything is."""
        self._scene = self._scene_of()
        self._mesh(self._scene, self._triangles.vertices(data), self._triangles.faces)

    def trace(self, origin: Floats, rays: Floats) -> Hits:
        """What the rays hit first."""
        origins = np.broadcast_to(origin, rays.shape).copy()
        found = self._scene.run(origins, rays, output=1)
        missed = found["primID"] < 0
        away = np.where(missed, np.inf, found["tfar"]).astype(np.float32)
        geoms = np.where(missed, -1, self._triangles.geoms[found["primID"]]).astype(np.int32)
        normals = np.asarray(found["Ng"], dtype=np.float32)
        return away, geoms, normals


class MujocoTracer:
    """By MuJoCo itself: slow, and always there.

    Args:
        model: MuJoCo's.
    """

    name = "rays"

    def __init__(self, model: Any) -> None:
        self._model = model
        self._groups = np.zeros(6, dtype=np.uint8)
        self._groups[np.unique(model.geom_group[drawn_geoms(model)])] = 1
        self._data: Any = None

    def look(self, data: Any) -> None:
        """Take in where everything is."""
        self._data = data

    def trace(self, origin: Floats, rays: Floats) -> Hits:
        """What the rays hit first."""
        n = len(rays)
        length = np.linalg.norm(rays, axis=1)
        unit = (rays / length[:, None]).astype(np.float64)
        geoms, away = np.full(n, -1, np.int32), np.full(n, -1.0)
        normals = np.zeros(3 * n)
        start, reach = np.asarray(origin, dtype=np.float64) * METRES, 2 * FAR * METRES
        mujoco.mj_multiRay(
            self._model, self._data, start, unit.ravel(), self._groups, True, -1, geoms, away,  # noqa: FBT003
            normals, n, reach,
        )  # fmt: skip
        away = np.where(geoms < 0, np.inf, away / METRES / length)
        return away.astype(np.float32), geoms, normals.reshape(-1, 3).astype(np.float32)


class RayRenderer:
    """Draws by a tracer.

    Args:
        model: MuJoCo's.
        tracer: Finds what rays hit.
    """

    def __init__(self, model: Any, tracer: Tracer) -> None:
        self._model, self._tracer = model, tracer
        self.name = tracer.name
        material = np.array(model.geom_matid)
        self._colours = geom_colours(model).astype(np.float32)
        self._gloss = np.zeros(model.ngeom, dtype=np.float32)
        self._shine = np.full(model.ngeom, 64.0, dtype=np.float32)
        has = material >= 0
        self._gloss[has] = model.mat_specular[material[has]]
        self._shine[has] = 128 * model.mat_shininess[material[has]]
        self._board = np.flatnonzero(material == model.material(BOARD).id)
        self._table = np.flatnonzero(material == model.material(TABLE).id)

    def look(self, data: Any, scene: Scene, lighting: Lighting) -> None:
        """Take in where everything is now."""
        self._scene, self._lighting = scene, lighting
        self._tracer.look(data)

    def geometry(self, view: View, region: Region) -> tuple[Depth, Ids]:
        """(h, w) depth along the view, mm, 0 for nothing, and number of the geom, -1 for nothing."""
        away, geoms, _ = self._first_hits(view, _rays(view, region))
        depth = np.where(geoms >= 0, away, 0).astype(np.float32)
        shape = (region.height, region.width)
        return depth.reshape(shape), geoms.astype(np.int16).reshape(shape)

    def _first_hits(self, view: View, rays: Floats) -> Hits:
        origin = view.robot_from_camera.translation.astype(np.float32)
        away, geoms, normals = self._tracer.trace(origin, rays)
        geoms = np.where(away < FAR, geoms, -1)
        return away, geoms, normals

    def colour(self, view: View, region: Region) -> Picture:
        """(h, w, 3) blue, green, red of a part of the picture."""
        rays = _rays(view, region)
        away, geoms, normals = self._first_hits(view, rays)
        hit = np.flatnonzero(geoms >= 0)
        out = np.empty((len(rays), 3), dtype=np.float32)
        out[:] = np.array(self._scene.look.room, dtype=np.float32) * self._lighting.on
        points = view.robot_from_camera.translation + rays[hit] * away[hit, None]
        out[hit] = self._shaded(points.astype(np.float32), rays[hit], geoms[hit], normals[hit])
        picture = np.clip(out[:, ::-1] * 255, 0, 255).astype(np.uint8)
        return np.ascontiguousarray(picture.reshape(region.height, region.width, 3))

    def _shaded(
        self,
        points: Floats,
        rays: Floats,
        geoms: npt.NDArray[np.int32],
        normals: Floats,
    ) -> Floats:
        """(n, 3) red, green, blue of (n, 3) points seen along (n, 3) rays."""
        lighting = self._lighting
        view = _unit(-rays)
        normals = _unit(normals)
        normals = normals * np.where((normals * view).sum(axis=1, keepdims=True) < 0, -1, 1)
        lamp, _ = lamp_and_board(self._scene, lighting)
        way = (lamp - points).astype(np.float32)
        to_lamp = _unit(way)
        facing = np.maximum((normals * to_lamp).sum(axis=1), 0)
        if lighting.shadows:
            facing = facing * self._lit(lamp.astype(np.float32), way, facing)
        glint = np.maximum((normals * _unit(to_lamp + view)).sum(axis=1), 0) ** self._shine[geoms]
        sky = AMBIENT_SHARE + (1 - AMBIENT_SHARE) * np.maximum(normals[:, 2], 0)
        light = lighting.on * (lighting.brightness * facing + lighting.ambient * sky)
        shine = lighting.on * SPECULAR_SHARE * lighting.brightness * self._gloss[geoms] * glint * (facing > 0)
        out: Floats = self._albedo(points, geoms) * light[:, None] + shine[:, None]
        return out

    def _lit(self, lamp: Floats, way: Floats, facing: Floats) -> npt.NDArray[np.bool_]:
        """(n,) whether nothing stands between the lamp and a point (n, 3) ``way`` from it."""
        lit = np.zeros(len(way), dtype=bool)
        ask = np.flatnonzero(facing > 0)
        if len(ask):  # from the lamp on: its rays start at one point, and what they meet first is lit
            away, _, _ = self._tracer.trace(lamp, np.ascontiguousarray(-way[ask]))
            lit[ask] = away > 1 - _TOUCH
        return lit

    def _albedo(self, points: Floats, geoms: npt.NDArray[np.int32]) -> Floats:
        """(n, 3) red, green, blue of surfaces."""
        out = self._colours[geoms]
        look, table = self._scene.look, self._scene.table
        on_board = np.flatnonzero(np.isin(geoms, self._board))
        if len(on_board):
            local = table.robot_from_board.inverse() @ points[on_board]
            paint = board_paint(look, table.square)
            out[on_board] = sampled(paint, board_pixels(look, table.square, local)) / 255
        on_table = np.flatnonzero(np.isin(geoms, self._table))
        if len(on_table):
            cloth = table_paint(look)
            on_cloth = (points[on_table, :2] + TABLE_HALF / METRES) % _CLOTH_MM
            out[on_table] = sampled(cloth, on_cloth * (cloth.shape[0] / _CLOTH_MM)) / 255
        return out

    def close(self) -> None:
        """Nothing is held."""


def _rays(view: View, region: Region) -> Floats:
    """(h w, 3) of the pixels, robot frame, one mm deep along the view."""
    lens = view.intrinsics
    rows, columns = np.mgrid[region.top : region.bottom, region.left : region.right]
    x, y = (columns.ravel() - lens.cx) / lens.fx, (rows.ravel() - lens.cy) / lens.fy
    local = np.stack([x, y, np.ones(len(x))], axis=1)
    return np.ascontiguousarray(local @ view.robot_from_camera.rotation.T, dtype=np.float32)


def _unit(vectors: Floats) -> Floats:
    out: Floats = vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-9)
    return out

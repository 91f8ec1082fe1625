"""Triangles of MuJoCo's shapes, for a ray tracer that knows nothing else."""

import math
from itertools import product
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array
from kempelen.twin.cameras.render import drawn_geoms
from kempelen.twin.physics.appearance import Faces, turned
from kempelen.twin.physics.bodies import TABLE_HALF
from kempelen.twin.physics.units import METRES

Solid = tuple[Array, Faces]

_ROUND, _RINGS = 32, 16
"""Facets round and from pole to pole: as OpenGL draws them."""


class Triangles:
    """All drawn geoms of a model as one mesh.

    Args:
        model: MuJoCo's.

    Attributes:
        faces: (m, 3) vertices of each triangle.
        geoms: (m,) that each triangle belongs to.
    """

    def __init__(self, model: Any) -> None:
        numbers = drawn_geoms(model)
        solids = [_solid(model, int(number)) for number in numbers]
        counts = [len(vertices) for vertices, _ in solids]
        starts = np.cumsum([0, *counts[:-1]])
        self._local = np.concatenate([vertices for vertices, _ in solids])
        self._owner = np.repeat(numbers, counts)
        self.faces = np.concatenate(
            [faces + start for (_, faces), start in zip(solids, starts, strict=True)]
        ).astype(np.int32)
        self.geoms = np.repeat(numbers, [len(faces) for _, faces in solids]).astype(np.int32)

    def vertices(self, data: Any) -> npt.NDArray[np.float32]:
        """(n, 3) mm, robot frame, as MuJoCo's kinematics has them."""
        turns = data.geom_xmat.reshape(-1, 3, 3)[self._owner]
        moved = np.einsum("nij,nj->ni", turns, self._local) + data.geom_xpos[self._owner]
        return np.asarray(moved / METRES, dtype=np.float32)


def _solid(model: Any, number: int) -> Solid:
    """Vertices, m, in the geom's frame, and faces."""
    size, kind = model.geom_size[number], int(model.geom_type[number])
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        return _mesh(model, int(model.geom_dataid[number]))
    if kind == mujoco.mjtGeom.mjGEOM_PLANE:
        return _plane(TABLE_HALF)
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return _box(size)
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        rim = [(0, -size[1]), (size[0], -size[1]), (size[0], size[1]), (0, size[1])]
        return turned(np.array(rim), _ROUND)
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return turned(_outline(float(size[0]), float(size[1])), _ROUND)
    vertices, faces = turned(_outline(1.0, 0.0), _ROUND)
    scale = size if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID else np.full(3, size[0])
    return vertices * scale, faces


def _mesh(model: Any, mesh: int) -> Solid:
    vertex, face = int(model.mesh_vertadr[mesh]), int(model.mesh_faceadr[mesh])
    vertices = model.mesh_vert[vertex : vertex + int(model.mesh_vertnum[mesh])]
    faces = model.mesh_face[face : face + int(model.mesh_facenum[mesh])]
    return np.array(vertices, dtype=np.float64), np.array(faces, dtype=np.int32)


def _plane(half: float) -> Solid:
    square = np.array([[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]])
    return square, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)


def _box(half: Array) -> Solid:
    corners = np.array(list(product((-1.0, 1.0), repeat=3))) * half
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [triangle for a, b, c, d in sides for triangle in ((a, b, c), (a, c, d))]
    return corners, np.array(faces, dtype=np.int32)


def _outline(radius: float, half: float) -> Array:
    """(n, 2) radius and height of a capsule from below; of a sphere where ``half`` is 0."""
    quarter = np.linspace(0, math.pi / 2, _RINGS // 2 + 1)
    top = [(radius * math.cos(angle), half + radius * math.sin(angle)) for angle in quarter]
    return np.array([(r, -z) for r, z in reversed(top)] + top)

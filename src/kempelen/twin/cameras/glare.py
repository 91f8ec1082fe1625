"""The lamp's reflection in the board: neither Lambert's law nor a texture shows it."""

import numpy as np

from kempelen.core.camera import Picture
from kempelen.core.geometry import Array
from kempelen.twin.cameras.region import Region
from kempelen.twin.cameras.render import Renderer, View, lamp_and_board
from kempelen.twin.cameras.settings import Lighting
from kempelen.twin.cameras.surfaces import Materials

_SPREAD = 0.09
"""Of the half angle under which a satin surface still reflects a lamp, rad (Gaussian)."""


def add_glare(
    picture: Picture,
    renderer: Renderer,
    view: View,
    region: Region,
    *,
    materials: Materials,
    lighting: Lighting,
) -> Picture:
    """(h, w, 3) the picture of that region with the lamp's reflection in the board."""
    depth, ids = renderer.geometry(view, region)
    rows, columns = np.nonzero(materials.board[ids])
    if not len(rows) or not lighting.on:
        return picture
    pixels = np.stack([columns + region.left, rows + region.top], axis=1)
    pose = view.robot_from_camera
    points = pose @ (view.intrinsics.rays(pixels) * depth[rows, columns, None])
    lamp, _ = lamp_and_board(materials.scene, lighting)
    half = _unit(lamp - points) + _unit(pose.translation - points)
    off = np.arccos(np.clip(_unit(half) @ materials.scene.table.upwards, -1, 1))
    light = 255 * lighting.glare * np.exp(-0.5 * np.square(off / _SPREAD))
    out = picture.copy()
    out[rows, columns] = np.minimum(out[rows, columns] + light[:, None], 255).astype(np.uint8)
    return out


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))

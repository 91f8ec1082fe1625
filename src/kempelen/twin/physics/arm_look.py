"""What an arm looks like: base, turret, links of two plates each, motors and wrist. Nothing can be touched.

Made from the measures of any arm's parameter file; of the Lab-Volt 5150 it has the proportions.
"""

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from kempelen.core.geometry import Transform
from kempelen.kinematics import Arm
from kempelen.twin.physics.appearance import PAINT, Rgba
from kempelen.twin.physics.units import METRES

_ENAMEL: Rgba = (0.80, 0.81, 0.80, 1.0)
_DARK: Rgba = (0.16, 0.17, 0.19, 1.0)
_STEEL: Rgba = (0.52, 0.54, 0.57, 1.0)
_LONG = 40.0
"""A link longer than this is a pair of plates, mm."""
_PLATE = 3.0
"""Half the thickness of a plate, mm."""
_FOOT = 75.0
"""Half the side of the base's box, mm."""
_GAPS = (36.0, 28.0, 22.0)
"""Half the distance of the plates of the first, second, third long link, mm: one folds into the other."""
Point3 = tuple[float, float, float]


def paint_arm(arm: Arm, bodies: Sequence[Any], after: Sequence[Transform]) -> None:
    """Make the bodies of an arm look like it.

    Args:
        arm: Its measures.
        bodies: (n + 1) MuJoCo bodies: the base, and those that turn, each about its own z axis.
        after: (n + 1) the frame of each link in its body's.
    """
    _paint_base(bodies[0], bodies[1], float(arm.links[0].d))
    long = 0
    for body, link in zip(bodies[1:], arm.links, strict=True):
        if abs(link.a) > _LONG:
            _paint_plates(body, link.a, _GAPS[min(long, len(_GAPS) - 1)])
            long += 1
    wrist = bodies[-2]
    _tube(wrist, (0, 0, -24), (0, 0, 24), 19.0, _DARK)
    end = float(after[-1].translation[2])
    _tube(bodies[-1], (0, 0, 0), (0, 0, 0.35 * end), 15.0, _STEEL)


def _paint_base(base: Any, turret: Any, height: float) -> None:
    """A box on the table, a turntable on it, and two cheeks that hold the shoulder."""
    box, neck = 0.42 * height, 0.5 * height
    _box(base, (0, 0, box / 2), (_FOOT, _FOOT, box / 2), _ENAMEL)
    _box(base, (0, 0, 4), (_FOOT + 18, _FOOT + 18, 4), _DARK)
    _tube(base, (0, 0, box), (0, 0, neck), 62.0, _DARK)
    top = height - neck
    _tube(turret, (0, 0, neck), (0, 0, neck + 0.16 * top), 58.0, _ENAMEL)
    for side in (-1, 1):
        y = side * (_GAPS[0] + 4 * _PLATE)
        _box(turret, (0, y, neck + 0.58 * top), (34, _PLATE, 0.46 * top), _ENAMEL)
        _tube(turret, (0, y - side * 2, height), (0, y + side * 14, height), 30.0, _DARK)
    _box(turret, (0, 0, neck + 0.3 * top), (26, _GAPS[0], 0.2 * top), _DARK)


def _paint_plates(body: Any, length: float, gap: float) -> None:
    """Two plates from joint to joint with a drum on each axis and a rod between."""
    across = 0.62 * gap + 6
    for side in (-1, 1):
        _box(body, (length / 2, 0, side * gap), (abs(length) / 2, across, _PLATE), _ENAMEL)
        for x in (0.0, length):
            _tube(body, (x, 0, side * (gap - _PLATE)), (x, 0, side * (gap + _PLATE + 1)), across, _ENAMEL)
    _tube(body, (0, 0, -gap), (0, 0, gap), 0.7 * across, _DARK)
    _tube(body, (length, 0, -gap), (length, 0, gap), 0.55 * across, _STEEL)
    _tube(body, (length / 2, 0, -gap), (length / 2, 0, gap), 5.0, _STEEL)


def _box(body: Any, where: Point3, half: Point3, rgba: Rgba) -> None:
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, pos=np.array(where) * METRES, size=np.array(half) * METRES, rgba=rgba,
        contype=0, conaffinity=0, group=PAINT, mass=0.0,
    )  # fmt: skip


def _tube(body: Any, start: Point3, end: Point3, radius: float, rgba: Rgba) -> None:
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER, fromto=np.array([*start, *end], dtype=np.float64) * METRES,
        size=(radius * METRES, 0, 0), rgba=rgba, contype=0, conaffinity=0, group=PAINT, mass=0.0,
    )  # fmt: skip
